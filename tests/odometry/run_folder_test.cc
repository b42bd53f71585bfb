#include "odometry/run/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "odometry/run/run_queries.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/same_run.h"
#include "tests/testing/small_run_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class RunFolderTest : public testing::SmallRunFolder {};

TEST_F(RunFolderTest, ComesBackAsItWasWritten) {
  const OdometryRun run = testing::MakeSmallRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  testing::ExpectSameRun(read, run);
  EXPECT_FALSE(read.complete);
  EXPECT_EQ(read.partial_reason, "interrupted");
  EXPECT_EQ(read.verdict->level, VerdictLevel::kFailed);
  testing::ExpectSame(read.timings.stages, run.timings.stages);
  EXPECT_EQ(read.timings.window_iterations, 37);
  EXPECT_EQ(read.timings.cpu_s, 2.5);
  EXPECT_EQ(read.timings.stereo_frames, 160);
  ASSERT_TRUE(read.timings.real_time.has_value());
  EXPECT_EQ(read.timings.real_time->skipped_images, 12);
  EXPECT_EQ(read.timings.real_time->latency_median_s, 0.0125);
  EXPECT_EQ(read.timings.real_time->latency_95_s, 0.03);
}

TEST_F(RunFolderTest, OfMoreThanTwoCamerasItSaysWhoseObservationsAre) {
  OdometryRun run = testing::MakeSmallRun();
  Rig& rig = run.rectified_rig;
  rig.Resize(3);
  rig.cameras[2] = rig.cameras[0];
  run.keyframes[0].observations[1].camera = run.keyframes[0].lines[1].camera = 2;
  WriteRunFolder(folder_, run);
  testing::ExpectSameRun(ReadRunFolder(folder_), run);
}

TEST_F(RunFolderTest, WhatWasHeldOfTheCalibrationIsSaidToBe) {
  OdometryRun run = testing::MakeSmallRun();
  run.calibration[0].lever_sigma_m.setZero();
  run.calibration[0].focal_length_sigma = 0;
  WriteRunFolder(folder_, run);
  const auto summary = nlohmann::json::parse(ReadFile(Path("run.json")));
  for (const char* item : {"time_offset_s", "imu_rotation_rad", "right_rotation_rad"}) {
    EXPECT_TRUE(summary["calibration"][item]["estimated"]) << item;
  }
  EXPECT_FALSE(summary["calibration"]["lever_m"]["estimated"]);
  EXPECT_FALSE(summary["calibration"]["focal_length"]["estimated"]);
}

TEST_F(RunFolderTest, TheCalibrationIsThatOfSegmentsOfTheRun) {
  OdometryRun run = testing::MakeSmallRun();
  run.calibration[0].segment = 2;
  WriteRunFolder(folder_, run);
  ExpectReadError("calibration.csv: row 2: segment: found '2'",
                  "a segment that a state or a keyframe is of");
  // Of one of which nothing is left there is none.
  run.states.back().velocity_world_m_s.x() = kNaN;
  WriteRunFolder(folder_, run);
  EXPECT_TRUE(ReadRunFolder(folder_).calibration.empty());
}

TEST_F(RunFolderTest, HasAnIdThatIsThatOfItsContents) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string id = ReadRunFolder(folder_).id;
  EXPECT_EQ(id.size(), 16u);
  WriteRunFolder(folder_, testing::MakeSmallRun());
  EXPECT_EQ(RunIdIn(folder_), id);
  OdometryRun other = testing::MakeSmallRun();
  other.landmarks[0].p_world.x() += 0.25;
  WriteRunFolder(folder_, other);
  EXPECT_NE(RunIdIn(folder_), id);
}

TEST_F(RunFolderTest, AnEmptyRunComesBackEmpty) {
  OdometryRun run;
  run.method = "points";
  run.rectified_rig = testing::MakeSmallRun().rectified_rig;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  testing::ExpectSameRun(read, run);
  EXPECT_FALSE(read.verdict || read.source);
  EXPECT_TRUE(ReadMapLines(Path("lines.ply")).empty());
}

TEST_F(RunFolderTest, PlyHoldsTheLinesForOtherProgramsButThoseOfWithdrawnDirections) {
  OdometryRun run = testing::MakeSmallRun();
  for (const LineAxis axis : {LineAxis::kX, LineAxis::kSloped}) {
    run.lines.push_back(run.lines[1]);
    run.lines.back().id = 7 + std::ssize(run.lines);
    run.lines.back().axis = axis;
    run.lines.back().world = 1;
  }
  WriteRunFolder(folder_, run);
  const std::vector<MapLine> lines = ReadMapLines(Path("lines.ply"));
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(std::tie(lines[1].id, lines[1].axis, lines[1].world),
            std::make_tuple(5, LineAxis::kY, 0));
  EXPECT_NEAR(lines[0].sigma_m, LargestSigma(run.lines[0]), 1e-9);
  EXPECT_NEAR(lines[1].deviation_rad, 0.002, 1e-9);
  EXPECT_NEAR(lines[1].deviation_sigma_rad, 0.0004, 1e-9);
  EXPECT_LT((lines[1].end_world - run.lines[1].end_world).norm(), 1e-6);
  EXPECT_EQ(std::tie(lines[2].axis, lines[2].world), std::make_tuple(LineAxis::kSloped, 0));
}

TEST_F(RunFolderTest, ALineOfASlopeThatThereIsNotIsRefused) {
  OdometryRun run = testing::MakeSmallRun();
  for (const int index : {-1, 2}) {
    run.lines[2].world = index;
    WriteRunFolder(folder_, run);
    ExpectReadError("lines.csv", "the index of a sloped direction");
  }
}

TEST_F(RunFolderTest, LinesFollowTheirDirectionsWhereOneIsDropped) {
  OdometryRun run = testing::MakeSmallRun();
  run.manhattan_worlds[0].heading_rad = run.sloped_directions[0].azimuth_rad = kNaN;
  for (const size_t line : {1, 2}) {  // of the next direction
    run.lines.push_back(run.lines[line]);
    run.lines.back().id += 10;
    run.lines.back().world = 1;
  }
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.warnings.at("manhattan_worlds_not_finite"), 1);
  EXPECT_EQ(read.warnings.at("sloped_directions_not_finite"), 1);
  run.manhattan_worlds.erase(run.manhattan_worlds.begin());
  run.sloped_directions.erase(run.sloped_directions.begin());
  run.lines = {run.lines[0], run.lines[3], run.lines[4]};
  run.lines[1].world = run.lines[2].world = 0;
  testing::ExpectSame(read.manhattan_worlds, run.manhattan_worlds);
  testing::ExpectSame(read.sloped_directions, run.sloped_directions);
  testing::ExpectSame(read.lines, run.lines);
}

TEST_F(RunFolderTest, AFullDiskNamesTheFileAndLeavesTheOldRun) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  OdometryRun longer = testing::MakeSmallRun();
  longer.method = "slc";
  for (const std::string name : {"trajectory.tum", "run.json"}) {
    const auto bytes = std::filesystem::file_size(Path(name));
    {
      const testing::FileSizeLimit full(name == "run.json" ? bytes - 10 : bytes / 2);
      EXPECT_THAT([&] { WriteRunFolder(folder_, longer); },
                  ThrowsMessage<OutputError>(HasSubstr("cannot be written")));
    }
    EXPECT_EQ(ReadRunFolder(folder_).method, "points");
  }
}

TEST_F(RunFolderTest, FileInPlaceOfFolder) {
  std::filesystem::create_directories(std::filesystem::path(folder_).parent_path());
  WriteFile(folder_, "not a folder");
  EXPECT_THROW(WriteRunFolder(folder_, testing::MakeSmallRun()), OutputError);
}

}  // namespace
}  // namespace slcmap
