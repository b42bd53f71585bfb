// A folder for a small run, for tests of what writes and reads it.
#include "odometry/run/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "odometry/run/run_queries.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/same_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace testing {

// A run of two keyframes, three landmarks and three lines in two segments, cut short.
OdometryRun MakeSmallRun() {
  OdometryRun run;
  run.method = "points";
  run.partial_reason = "interrupted";
  run.warnings = {{"imu_gap", 2}};
  for (Camera& camera : run.rectified_rig.cameras) {
    camera = {Distortion::kNone,      752, 480, 458.5, 457.25, 367.125, 248.375,
              Eigen::Vector4d::Zero()};
  }
  run.rectified_rig.T_imu_camera[1].translation = {0.11, 0.01, 0.001};
  run.rectified_rig.imu_noise.rate_hz = 100;
  run.rectified_rig.camera_time_offset_s = 0.0125;
  for (int i = 0; i < 5; ++i) {
    OnlineState state;
    state.stamp_ns = 1403636579763555584 + i * 50000000;
    state.segment = i / 3;
    state.T_world_imu = {ExpRotation({0.1 * i, 0.2, 0.3}), {1.0 / 3 * i, 2, 3}};
    state.velocity_world_m_s = {0.1 * i, 0.7, 1e-17};
    state.gyro_bias_rad_s = {0.001, 0.002, 0.003};
    state.accel_bias_m_s2 = {-0.01, 0.02, 0.03};
    run.states.push_back(state);
  }
  run.keyframes = {
      {7,
       0,
       run.states[0].stamp_ns,
       run.states[0].T_world_imu,
       {{1, {10.5, 20.25}, Eigen::Vector2d(8.125, 20.25)}, {2, {100, 200}, std::nullopt, 1}},
       {{4, {{1.5, 2}, {3, 4.25}}, LineSegment{{1, 2}, {2.5, 4.25}}},
        {999, {{5, 6}, {7, 8}}, std::nullopt, 1}}},  // never became a line
      {9, 1, run.states[3].stamp_ns, run.states[3].T_world_imu, {}, {}}};
  run.landmarks = {
      {1, 0, {1.5, -2.25, 3}, 0.125, 4}, {2, 0, {0.5, 4, 8}, 0.5, 2}, {3, 1, {7, 8, 9}, 0.25, 3}};
  run.manhattan_worlds = {{0, 0.25, 0.001, 5}, {1, -0.5, 0.002, 1600000003123456789, true}};
  run.sloped_directions = {{0, 1.5, 0.5, 0.001, 0.002, 1600000003123456789, false},
                           {0, -2.5, 0.1, 0, 0.003, 5, true}};
  run.lines.resize(3);
  run.lines[0] = {4, 0,     LineAxis::kVertical, -1, {1.0 / 3, 0, 1}, {1.0 / 3, 0, 2}, {}, 0, 0, 3,
                  7, {1, 2}};
  run.lines[0].covariance_m2 << 1e-4, 2e-5, 3e-6, 2e-5, 4e-4, 5e-7, 3e-6, 5e-7, 6e-4;
  run.lines[1] = {5, 1, LineAxis::kY, 0, {3, 0, 0}, {3, 4, 0}, {}, 0.002, 0.0004, 0, 0, {}};
  run.lines[2] = {6, 0, LineAxis::kSloped, 0, {0, 0, 0}, {1, 0, 1}, {}, 0, 0, 0, 0, {}};
  run.line_deviation_rad = 0.0033;
  run.figures.points_rejected = {0.25, 0.5, 40};
  run.verdict.emplace();
  run.verdict->Add({VerdictLevel::kGood, "corrected", "a", "b", "c"});
  run.verdict->Add({VerdictLevel::kFailed, "speed", "9 m/s", "3 m/s", "check it"});
  run.imu = {{5, {0.1, 0.2, 1.0 / 3}, {1, 2, 9.81}}, {6, Eigen::Vector3d::Zero(), {0, 0, 1e-17}}};
  CalibrationEstimate& found = run.calibration.emplace_back();
  found.stamp_ns = run.states[3].stamp_ns;
  found.segment = 1;
  found.time_offset_s = -0.0125;
  found.imu_rotation_rad = {0.01, -0.02, 1.0 / 3};
  found.lever_m = {0.001, 0.002, 0.003};
  found.right_rotation_rad = {0.004, 0.005, 0.006};
  found.focal_length = 0.0035;
  found.right_centre_px = {1.25, -0.5};
  found.imu_errors = ImuErrors::LinSpaced(-0.015, 0.02);
  found.imu_errors_sigma = ImuErrors::LinSpaced(1e-4, 3e-3);
  found.time_offset_sigma_s = 1e-4;
  found.imu_rotation_sigma_rad = {1e-3, 2e-3, 3e-3};
  found.lever_sigma_m = {4e-3, 5e-3, 6e-3};
  found.right_rotation_sigma_rad = {7e-5, 8e-5, 9e-5};
  found.focal_length_sigma = 2.5e-4;
  found.right_centre_sigma_px = {0.125, 0.25};
  run.source = {"0.1.0",
                "/recordings/hall",
                "its own",
                "method: points\n",
                {{kRightTurnCorrection, {0.25, 0, -0.125}, "right camera turned"}},
                run.rectified_rig,
                {{5, "cam0/data/5.png", "cam1/data/5.png"}, {6, "cam0/data/6.png", ""}},
                {}};
  run.source->opened = {.calibration = "/recordings/chain.yaml",
                        .max_stereo_offset_s = 0.008,
                        .right_offset_s = -0.012,
                        .masks = {"/recordings/left.png", "none"},
                        .cameras = {0, 2},
                        .pieces = {{5, 6, -1, 2, true}, {8, 9, 0, 0, false}}};
  run.source->raw_rig.cameras[0].distortion = Distortion::kEquidistant;
  run.source->raw_rig.masks[0] =
      cv::Mat(run.source->raw_rig.cameras[0].height_px, run.source->raw_rig.cameras[0].width_px,
              CV_8UC1, cv::Scalar(255));
  run.source->raw_rig.masks[0].row(3) = 0;
  run.timings.stages = {{"points", 1.25, 160}};
  run.timings.window_iterations = 37;
  run.timings.cpu_s = 2.5;
  run.timings.stereo_frames = 160;
  run.timings.real_time = {12, 0.0125, 0.03};
  return run;
}

class SmallRunFolder : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  // Reading must fail with a message that holds both.
  void ExpectReadError(const std::string& place, const std::string& what) {
    EXPECT_THAT([&] { ReadRunFolder(folder_); },
                ::testing::ThrowsMessage<DataError>(
                    ::testing::AllOf(::testing::HasSubstr(place), ::testing::HasSubstr(what))));
  }

  TempFolder temp_;
  const std::string folder_ = temp_.Path("made/run");
};

}  // namespace testing

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

using ::testing::AllOf;

class RunFolderDamageTest : public testing::SmallRunFolder {
 protected:
  // Writes a good run, and then another text in the place of one.
  void Change(const std::string& file, const std::string& from, const std::string& to) const {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::string text = ReadFile(Path(file));
    ASSERT_NE(text.find(from), text.npos) << from;
    WriteFile(Path(file), text.replace(text.find(from), from.size(), to));
  }
};

TEST_F(RunFolderDamageTest, MissingFilesAreNamed) {
  for (const char* name :
       {"trajectory.tum", "states.csv", "keyframes.csv", "observations.csv", "points.ply",
        "rig.json", "timings.json", "run.json", "imu.csv", "raw_rig.json", "options.yaml",
        "images.csv", "lines.ply", "calibration.csv", "lines.csv", "line_observations.csv",
        "line_points.csv"}) {
    std::filesystem::remove_all(folder_);
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::filesystem::remove(Path(name));
    ExpectReadError(name, folder_);
  }
}

// Makes row 2 of a table, the first below the columns, another one.
struct Damage {
  const char* file;
  std::string row;
  const char* message;
};

TEST_F(RunFolderDamageTest, DamagedRowsAreNamed) {
  const std::string pose = ",0,0,0,0,0,0,1", rest = ",0,0,0,0,0,0,0,0,0";
  const std::string far = "3,0" + std::string(",1e30,0,0,0,0,0,1") + rest,
                    fast = "3,0" + pose + ",1e30,0,0,0,0,0,0,0,0",
                    unit = "3,0,0,0,0,0.5,0.5,0,0.5" + rest,
                    line = ",0,0,0,1,1,1,0,0,0,0,0,0,3,5,0,0", one = ",nan,nan,nan,nan";
  // A row of zeros but for one value.
  const auto correction = [](int at, const std::string& value) {
    std::string row = "1403636579913555584,1";
    for (int column = 0; column < 56; ++column) row += "," + (column == at ? value : "0");
    return row;
  };
  const Damage damages[] = {
      {"states.csv", far, "x_m: found '1e30', expected -1000000 to 1000000"},
      {"states.csv", fast, "vx_m_s: found '1e30'"},
      {"states.csv", unit, "expected a quaternion of length 1"},
      {"states.csv", "3,-1", "found 2 columns, expected 18"},
      {"keyframes.csv", "-7,0,5,0,0,0,0,0,0,1", "id: found '-7', expected 0 to 2147483647"},
      {"observations.csv", "7,1,abc,2,nan,nan", "left_x_px: found 'abc', expected a finite number"},
      {"observations.csv", "7,1,nan,2,nan,nan", "left_x_px: found 'nan'"},
      {"observations.csv", "7,1,1e9,2,nan,nan", "left_x_px: found '1e9'"},
      {"observations.csv", "7,1,1,2,3,nan", "nan in all of the right image's columns or in none"},
      {"observations.csv", "8,1,1,2,nan,nan", "keyframe_id: found '8'"},
      {"imu.csv", "5,0,0,1e3,0,0,0", "wz_rad_s: found '1e3', expected -100 to 100"},
      {"lines.csv", "7,0,5,-1" + line, "axis: found '5'"},
      {"lines.csv", "7,0,1,2" + line, "world: found '2'"},
      {"lines.csv", "7,0,1,-2" + line, "world: found '-2'"},
      {"lines.csv", "7,0,1,0,0,nan" + line.substr(4), "start_y_m: found 'nan'"},
      {"line_points.csv", "7,3", "line_id: found '7'"},
      {"line_observations.csv", "77,4,1,2,3,4" + one, "keyframe_id: found '77'"},
      {"line_observations.csv", "7,4,1,2,x,4" + one, "left_end_x_px: found 'x'"},
      {"line_observations.csv", "7,4,1,2,3,4,5,nan,nan,nan", "right_start_y_px: found 'nan'"},
      {"calibration.csv", correction(0, "900"), "time_offset_s: found '900', expected -10 to 10"},
      {"calibration.csv", correction(2, "-4"), "imu_rotation_y_rad: found '-4', expected -3.2"},
      {"calibration.csv", correction(5, "200"), "lever_y_m: found '200', expected -100 to 100"},
      {"calibration.csv", correction(7, "4"), "right_rotation_x_rad: found '4', expected -3.2"},
      {"calibration.csv", correction(10, "-2"), "focal_length: found '-2', expected -0.9 to 0.9"}};
  for (const Damage& damage : damages) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::string text = ReadFile(Path(damage.file));
    const std::size_t start = text.find('\n') + 1;
    text.replace(start, text.find('\n', start) - start, damage.row);
    WriteFile(Path(damage.file), text);
    ExpectReadError(std::string(damage.file) + ": row 2: ", damage.message);
    // The same where changes are accepted: values are checked in any case.
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr(damage.message)));
  }
  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(Path("observations.csv"), "a,b\n");
  ExpectReadError("observations.csv: row 1", "found the columns 'a,b'");
}

TEST_F(RunFolderDamageTest, RowsThatContradictOthersAreNamed) {
  for (const auto& [file, what] :
       {std::pair("states.csv",
                  "stamp_ns: found '1403636579763555584', expected a stamp after "
                  "1403636579963555584"),
        std::pair("keyframes.csv", "id: found '7', expected an id that no row before it has"),
        std::pair("observations.csv", "landmark_id: found '1', expected an id that no row"),
        std::pair("lines.csv", "id: found '4'"),
        std::pair("imu.csv", "stamp_ns: found '5', expected a stamp after 6")}) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    const std::string path = Path(file), text = ReadFile(path);
    const std::size_t first = text.find('\n') + 1;
    WriteFile(path, text + text.substr(first, text.find('\n', first) + 1 - first));
    ExpectReadError(std::string(file) + ": row ", what);
  }
}

TEST_F(RunFolderDamageTest, ChangedFilesAreRefusedUnlessAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = Path("observations.csv"), text = ReadFile(path);
  WriteFile(path, text.substr(0, text.rfind("7,2,")));
  ExpectReadError(folder_ + ": found 1 observations, expected 2 as in run.json",
                  "--accept-changed");
  EXPECT_EQ(ReadRunFolder(folder_, {.accept_changed = true}).keyframes[0].observations.size(), 1u);
  Change("observations.csv", "10.5", "11.5");
  ExpectReadError("observations.csv: found ", "expected ");
  WriteFile(path, text);
  // The file of another run does not belong here.
  OdometryRun other = testing::MakeSmallRun();
  other.landmarks[0].sigma_m = 0.25;
  WriteRunFolder(temp_.Path("other"), other);
  std::filesystem::copy_file(temp_.Path("other/points.ply"), Path("points.ply"),
                             std::filesystem::copy_options::overwrite_existing);
  ExpectReadError("points.ply: found ", "as in run.json: written by another run or changed since");
}

// Runs of the same version from before it was estimated.
TEST_F(RunFolderDamageTest, ARunWithoutItsCalibrationIsRead) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  std::filesystem::remove(Path("calibration.csv"));
  EXPECT_TRUE(ReadRunFolder(folder_, {.accept_changed = true}).calibration.empty());
}

// Nothing depends on it.
TEST_F(RunFolderDamageTest, DamagedTimingsAreLeftOutWhereChangesAreAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  for (const char* text : {"{\"cpu_s\": -1}", "{", ""}) {
    WriteFile(Path("timings.json"), text);
    ExpectReadError("timings.json: ", "expected");
    const OdometryRun read = ReadRunFolder(folder_, {.accept_changed = true});
    EXPECT_EQ(read.states.size(), 5u);
    EXPECT_EQ(read.warnings.at("timings_unreadable"), 1);
    EXPECT_EQ(read.timings.cpu_s, 0);
  }
}

TEST_F(RunFolderDamageTest, TheSummaryCountsPointsOfShortLives) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string text = ReadFile(Path("run.json"));
  EXPECT_THAT(text, AllOf(HasSubstr("\"points\": 2"), HasSubstr("\"seen_once\": 2")));
}

TEST_F(RunFolderDamageTest, AChangedSummaryIsRefused) {
  Change("run.json", "\"method\": \"points\"", "\"method\": \"plane\"");
  ExpectReadError("run.json: method: found 'plane'", "expected points-mono");
  Change("run.json", "\"level\": \"failed\"", "\"level\": \"good\"");
  ExpectReadError("run.json: verdict", "expected 'failed'");
  Change("run.json", "\"level\": \"failed\"", "\"level\": \"great\"");
  ExpectReadError("run.json: verdict", "found 'great'");
  Change("run.json", "\"imu_gap\": 2", "\"imu_gap\": -2");
  ExpectReadError("run.json: warnings: imu_gap: found -2", "at least 0");
  Change("run.json", "\"imu_gap\": 2", "\"imu_gap\": 3");
  ExpectReadError("run.json: found checksum", "--accept-changed");
  Change("run.json", "\"states\": 5", "\"states\": 6");
  ExpectReadError("found 5 states, expected 6", "run.json");
}

TEST_F(RunFolderDamageTest, DamagedPlyAndJsonAreNamed) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string points = Path("points.ply");
  std::string bytes = ReadFile(points);
  bytes.resize(bytes.size() - 5);
  WriteFile(points, bytes);
  ExpectReadError("points.ply", "cut short: found 2 rows of element vertex, expected 3");

  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(Path("rig.json"), "{\"cameras\": [");
  ExpectReadError("rig.json: found no valid JSON at byte 14", "expected");
  WriteFile(Path("rig.json"), "{\"cameras\": [1, 2]}");
  ExpectReadError("rig.json: found a value of a wrong type", "expected");
  WriteFile(Path("rig.json"), "{}");
  ExpectReadError("rig.json: cameras: missing", "expected");
  for (const int version : {1, 2, 99}) {
    WriteFile(Path("run.json"),
              "{\"format\": \"slcmap run\", \"version\": " + std::to_string(version) + "}");
    ExpectReadError("run.json",
                    "version " + std::to_string(version) + ", expected 'slcmap run' of version 6");
  }
}

TEST_F(RunFolderDamageTest, AnAbsurdRigIsRefused) {
  for (const auto& [from, to] :
       {std::pair("\"fx_px\": 458.5", "\"fx_px\": 0.0"),
        std::pair("\"fx_px\": 458.5", "\"fx_px\": -458.5"),
        std::pair("\"rate_hz\": 100", "\"rate_hz\": -100"),
        std::pair("\"camera_time_offset_s\": 0.0125", "\"camera_time_offset_s\": 1e9")}) {
    Change("rig.json", from, to);
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("rig.json: "), HasSubstr("expected"))));
  }
}

}  // namespace
}  // namespace slcmap
