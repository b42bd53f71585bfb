#include "odometry/run/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "tests/testing/file_size_limit.h"
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
  EXPECT_EQ(read.method, "points");
  EXPECT_FALSE(read.complete);
  EXPECT_EQ(read.partial_reason, "interrupted");
  EXPECT_EQ(read.warnings, run.warnings);
  EXPECT_EQ(read.timings.stages[0].name, "points");
  EXPECT_EQ(read.timings.stages[0].calls, 160);
  EXPECT_EQ(read.timings.window_iterations, 37);
  EXPECT_EQ(read.timings.cpu_s, 2.5);
  EXPECT_EQ(read.timings.stereo_frames, 160);
  ASSERT_TRUE(read.timings.real_time.has_value());
  EXPECT_EQ(read.timings.real_time->skipped_images, 12);
  EXPECT_EQ(read.timings.real_time->latency_median_s, 0.0125);
  EXPECT_EQ(read.timings.real_time->latency_95_s, 0.03);
  EXPECT_EQ(read.rectified_rig.cameras[1].fy_px, 457.25);
  EXPECT_EQ(read.rectified_rig.T_imu_camera[1].translation.x(), 0.11);
  EXPECT_EQ(read.rectified_rig.imu_noise.rate_hz, 100);
  EXPECT_EQ(read.rectified_rig.camera_time_offset_s, 0.0125);
}

TEST_F(RunFolderTest, WhatTheSecondCameraAloneSawComesBack) {
  OdometryRun run = testing::MakeSmallRun();
  run.keyframes[0].observations[1].camera = 1;
  LineObservation& line = run.keyframes[0].lines.emplace_back();
  line = {4, {{1.5, 2}, {3, 4.25}}, std::nullopt, 1};
  WriteRunFolder(folder_, run);
  const Keyframe read = ReadRunFolder(folder_).keyframes[0];
  EXPECT_EQ(read.observations[0].camera, 0);
  EXPECT_EQ(read.observations[1].camera, 1);
  EXPECT_EQ(read.observations[1].left_px, Eigen::Vector2d(100, 200));
  EXPECT_FALSE(read.observations[1].right_px.has_value());
  ASSERT_EQ(read.lines.size(), 1u);
  EXPECT_EQ(read.lines[0].camera, 1);
  EXPECT_EQ(read.lines[0].left_px.end, line.left_px.end);
}

TEST_F(RunFolderTest, TheVerdictComesBackWithWhatItIsBasedOn) {
  OdometryRun run = testing::MakeSmallRun();
  WriteRunFolder(folder_, run);
  EXPECT_FALSE(ReadRunFolder(folder_).verdict.has_value());
  run.figures.points_rejected = {0.25, 0.5, 40};
  run.verdict.emplace();
  run.verdict->Add({VerdictLevel::kGood, "corrected", "a", "b", "c"});
  run.verdict->Add({VerdictLevel::kFailed, "points-rejected", "50 %", "12 %", "check it"});
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.figures.points_rejected.mean, 0.25);
  EXPECT_EQ(read.figures.points_rejected.worst, 0.5);
  EXPECT_EQ(read.figures.points_rejected.count, 40);
  ASSERT_TRUE(read.verdict.has_value());
  EXPECT_EQ(read.verdict->level, VerdictLevel::kFailed);
  ASSERT_EQ(read.verdict->reasons.size(), 2u);
  EXPECT_EQ(InWords(read.verdict->reasons[0]),
            "points-rejected: found 50 %, expected 12 %; remedy: check it");
  EXPECT_EQ(read.verdict->reasons[1].level, VerdictLevel::kGood);
}

TEST_F(RunFolderTest, AVerdictThatIsNoneIsRefused) {
  OdometryRun run = testing::MakeSmallRun();
  run.verdict.emplace();
  run.verdict->Add({VerdictLevel::kFailed, "speed", "a", "b", "c"});
  WriteRunFolder(folder_, run);
  const std::string path = folder_ + "/run.json", text = ReadFile(path);
  for (const auto& [to, message] : {std::pair("\"level\": \"good\"", "expected 'failed'"),
                                    std::pair("\"level\": \"great\"", "found 'great'")}) {
    const std::string from = "\"level\": \"failed\"";
    std::string damaged = text;
    damaged.replace(damaged.find(from), from.size(), to);
    WriteFile(path, damaged);
    ExpectReadError("run.json: verdict", message);
  }
}

TEST_F(RunFolderTest, StatesComeBack) {
  const OdometryRun run = testing::MakeSmallRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  const auto values = [](const OnlineState& state) {
    return std::tie(state.stamp_ns, state.segment, state.velocity_world_m_s, state.gyro_bias_rad_s,
                    state.accel_bias_m_s2);
  };
  ASSERT_EQ(read.states.size(), run.states.size());
  for (std::size_t i = 0; i < run.states.size(); ++i) {
    const OnlineState &a = read.states[i], &b = run.states[i];
    EXPECT_TRUE(values(a) == values(b)) << i;
    EXPECT_TRUE(a.T_world_imu.translation.isApprox(b.T_world_imu.translation, 1e-8));
    EXPECT_LT(a.T_world_imu.rotation.angularDistance(b.T_world_imu.rotation), 1e-7);
  }
}

TEST_F(RunFolderTest, KeyframesAndLandmarksComeBack) {
  const OdometryRun run = testing::MakeSmallRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.keyframes.size(), 2u);
  EXPECT_EQ(read.keyframes[1].id, 9);
  EXPECT_EQ(read.keyframes[1].segment, 1);
  EXPECT_EQ(read.keyframes[1].stamp_ns, run.keyframes[1].stamp_ns);
  EXPECT_EQ(read.keyframes[1].T_world_imu.translation, run.keyframes[1].T_world_imu.translation);
  ASSERT_EQ(read.keyframes[0].observations.size(), 2u);
  EXPECT_EQ(read.keyframes[0].observations[0].left_px, Eigen::Vector2d(10.5, 20.25));
  EXPECT_EQ(read.keyframes[0].observations[0].right_px, Eigen::Vector2d(8.125, 20.25));
  EXPECT_FALSE(read.keyframes[0].observations[1].right_px.has_value());
  ASSERT_EQ(read.landmarks.size(), 3u);
  EXPECT_EQ(read.landmarks[2].id, 3);
  EXPECT_EQ(read.landmarks[2].segment, 1);
  EXPECT_EQ(read.landmarks[0].p_world, Eigen::Vector3d(1.5, -2.25, 3));
  EXPECT_EQ(read.landmarks[0].sigma_m, 0.125);
  EXPECT_EQ(read.landmarks[0].observations, 4);
}

TEST_F(RunFolderTest, TheCalibrationComesBack) {
  const OdometryRun run = testing::MakeSmallRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.calibration.size(), 1u);
  const auto values = [](const CalibrationEstimate& found) {
    return std::tie(found.stamp_ns, found.segment, found.time_offset_s, found.imu_rotation_rad,
                    found.lever_m, found.right_rotation_rad, found.focal_length,
                    found.right_centre_px, found.imu_errors, found.imu_errors_sigma);
  };
  const auto sigmas = [](const CalibrationEstimate& found) {
    return std::tie(found.time_offset_sigma_s, found.imu_rotation_sigma_rad, found.lever_sigma_m,
                    found.right_rotation_sigma_rad, found.focal_length_sigma,
                    found.right_centre_sigma_px);
  };
  EXPECT_TRUE(values(read.calibration[0]) == values(run.calibration[0]));
  EXPECT_TRUE(sigmas(read.calibration[0]) == sigmas(run.calibration[0]));
  EXPECT_THAT(ReadFile(folder_ + "/run.json"), HasSubstr("\"focal_length\""));
}

TEST_F(RunFolderTest, WhatWasHeldOfTheCalibrationIsSaidToBe) {
  OdometryRun run = testing::MakeSmallRun();
  run.calibration[0].lever_sigma_m.setZero();
  run.calibration[0].focal_length_sigma = 0;
  WriteRunFolder(folder_, run);
  const auto summary = nlohmann::json::parse(ReadFile(folder_ + "/run.json"));
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

TEST_F(RunFolderTest, SaysHowPairsWereMended) {
  OdometryRun run = testing::MakeSmallRun();
  run.source->opened.pieces = {{5, 6, -1, 2, true}, {8, 9, 0, 0, false}};
  WriteRunFolder(folder_, run);
  const std::vector<PairPiece> read = ReadRunFolder(folder_).source->opened.pieces;
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(std::tie(read[0].from_ns, read[0].to_ns, read[0].later, read[0].late),
            std::make_tuple(5, 6, -1, 2));
  EXPECT_TRUE(read[0].has_right && !read[1].has_right);
}

TEST_F(RunFolderTest, SaysWhereItCameFrom) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_TRUE(read.source.has_value());
  EXPECT_EQ(read.source->version, "0.1.0");
  EXPECT_EQ(read.source->sequence, "/recordings/hall");
  EXPECT_EQ(read.source->calibration, "its own");
  EXPECT_EQ(read.source->options, "method: points\n");
  ASSERT_EQ(read.source->corrections.size(), 1u);
  EXPECT_EQ(read.source->corrections[0].name, kRightTurnCorrection);
  EXPECT_EQ(read.source->corrections[0].values, (std::vector<double>{0.25, 0, -0.125}));
  EXPECT_EQ(read.source->corrections[0].words, "right camera turned");
  EXPECT_EQ(read.source->raw_rig.cameras[0].distortion, Distortion::kEquidistant);
  EXPECT_EQ(read.source->raw_rig.masks[0].at<uchar>(3, 5), 0);
  EXPECT_EQ(read.source->raw_rig.masks[0].at<uchar>(4, 5), 255);
  EXPECT_TRUE(read.source->raw_rig.masks[1].empty());
  EXPECT_EQ(read.source->opened.cameras, (std::vector<int>{0, 2}));
  EXPECT_EQ(read.source->opened.calibration, "/recordings/chain.yaml");
  EXPECT_EQ(read.source->opened.masks, (std::vector<std::string>{"/recordings/left.png", "none"}));
  EXPECT_EQ(read.source->opened.max_stereo_offset_s, 0.008);
  EXPECT_EQ(read.source->opened.right_offset_s, -0.012);
  ASSERT_EQ(read.source->images.size(), 2u);
  EXPECT_EQ(read.source->images[0].right_path, "cam1/data/5.png");
  EXPECT_EQ(read.source->images[1].left_path, "cam0/data/6.png");
  EXPECT_EQ(read.source->images[1].right_path, "");
  ASSERT_EQ(read.imu.size(), 2u);
  EXPECT_EQ(read.imu[0].angular_velocity_rad_s.z(), 1.0 / 3);
  EXPECT_EQ(read.imu[1].specific_force_m_s2.z(), 1e-17);
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

TEST_F(RunFolderTest, EmptyRunComesBackEmpty) {
  OdometryRun run = testing::MakeSmallRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
  run.calibration.clear();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_TRUE(read.states.empty() && read.keyframes.empty() && read.landmarks.empty());
  const PlyFile lines = ReadPly(folder_ + "/lines.ply");
  EXPECT_EQ(lines.Get("edge", "lines.ply").size(), 0u);
}

TEST_F(RunFolderTest, AFullDiskNamesTheFileAndLeavesTheOldRun) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  OdometryRun longer = testing::MakeSmallRun();
  longer.method = "slc";
  for (const std::string name : {"trajectory.tum", "run.json"}) {
    const auto bytes = std::filesystem::file_size(folder_ + "/" + name);
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
