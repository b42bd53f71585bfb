#include "odometry/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "data/error.h"
#include "data/file.h"
#include "data/ply.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A run of two keyframes and three landmarks in two segments, cut short.
OdometryRun MakeRun() {
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
       {{1, {10.5, 20.25}, Eigen::Vector2d(8.125, 20.25)}, {2, {100, 200}, std::nullopt}},
       {}},
      {9, 1, run.states[3].stamp_ns, run.states[3].T_world_imu, {}, {}}};
  run.landmarks = {
      {1, 0, {1.5, -2.25, 3}, 0.125, 4}, {2, 0, {0.5, 4, 8}, 0.5, 2}, {3, 1, {7, 8, 9}, 0.25, 3}};
  run.imu = {{5, {0.1, 0.2, 1.0 / 3}, {1, 2, 9.81}}, {6, {}, {0, 0, 1e-17}}};
  CalibrationEstimate& found = run.calibration.emplace_back();
  found.stamp_ns = run.states[3].stamp_ns;
  found.segment = 1;
  found.time_offset_s = -0.0125;
  found.imu_rotation_rad = {0.01, -0.02, 1.0 / 3};
  found.lever_m = {0.001, 0.002, 0.003};
  found.right_rotation_rad = {0.004, 0.005, 0.006};
  found.focal_length = 0.0035;
  found.time_offset_sigma_s = 1e-4;
  found.imu_rotation_sigma_rad = {1e-3, 2e-3, 3e-3};
  found.lever_sigma_m = {4e-3, 5e-3, 6e-3};
  found.right_rotation_sigma_rad = {7e-5, 8e-5, 9e-5};
  found.focal_length_sigma = 2.5e-4;
  run.source = {"0.1.0",
                "/recordings/hall",
                "its own",
                "method: points\n",
                {{kRightTurnCorrection, {0.25, 0, -0.125}, "right camera turned"}},
                run.rectified_rig,
                {{5, "cam0/data/5.png", "cam1/data/5.png"}, {6, "cam0/data/6.png", ""}},
                {}};
  run.source->raw_rig.cameras[0].distortion = Distortion::kEquidistant;
  run.timings.stages = {{"points", 1.25, 160}};
  run.timings.window_iterations = 37;
  run.timings.cpu_s = 2.5;
  run.timings.stereo_frames = 160;
  run.timings.real_time = {12, 0.0125, 0.03};
  return run;
}

class RunFolderTest : public ::testing::Test {
 protected:
  // Reading must fail with a message that holds both.
  void ExpectReadError(const std::string& place, const std::string& what) {
    EXPECT_THAT([&] { ReadRunFolder(folder_); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(place), HasSubstr(what))));
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/run");
};

TEST_F(RunFolderTest, ComesBackAsItWasWritten) {
  const OdometryRun run = MakeRun();
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

TEST_F(RunFolderTest, TheVerdictComesBackWithWhatItIsBasedOn) {
  OdometryRun run = MakeRun();
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
  OdometryRun run = MakeRun();
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
  const OdometryRun run = MakeRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.states.size(), run.states.size());
  for (std::size_t i = 0; i < run.states.size(); ++i) {
    const OnlineState &a = read.states[i], &b = run.states[i];
    EXPECT_EQ(a.stamp_ns, b.stamp_ns);
    EXPECT_EQ(a.segment, b.segment);
    EXPECT_EQ(a.velocity_world_m_s, b.velocity_world_m_s);
    EXPECT_EQ(a.gyro_bias_rad_s, b.gyro_bias_rad_s);
    EXPECT_EQ(a.accel_bias_m_s2, b.accel_bias_m_s2);
    EXPECT_TRUE(a.T_world_imu.translation.isApprox(b.T_world_imu.translation, 1e-8));
    EXPECT_LT(a.T_world_imu.rotation.angularDistance(b.T_world_imu.rotation), 1e-7);
  }
}

TEST_F(RunFolderTest, KeyframesAndLandmarksComeBack) {
  const OdometryRun run = MakeRun();
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
  const OdometryRun run = MakeRun();
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.calibration.size(), 1u);
  const CalibrationEstimate &a = read.calibration[0], &b = run.calibration[0];
  EXPECT_EQ(a.stamp_ns, b.stamp_ns);
  EXPECT_EQ(a.segment, 1);
  EXPECT_EQ(a.time_offset_s, b.time_offset_s);
  EXPECT_EQ(a.imu_rotation_rad, b.imu_rotation_rad);
  EXPECT_EQ(a.lever_m, b.lever_m);
  EXPECT_EQ(a.right_rotation_rad, b.right_rotation_rad);
  EXPECT_EQ(a.focal_length, b.focal_length);
  EXPECT_EQ(a.time_offset_sigma_s, b.time_offset_sigma_s);
  EXPECT_EQ(a.imu_rotation_sigma_rad, b.imu_rotation_sigma_rad);
  EXPECT_EQ(a.lever_sigma_m, b.lever_sigma_m);
  EXPECT_EQ(a.right_rotation_sigma_rad, b.right_rotation_sigma_rad);
  EXPECT_EQ(a.focal_length_sigma, b.focal_length_sigma);
  EXPECT_THAT(ReadFile(folder_ + "/run.json"), HasSubstr("\"focal_length\""));
}

TEST_F(RunFolderTest, WhatWasHeldOfTheCalibrationIsSaidToBe) {
  OdometryRun run = MakeRun();
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

TEST_F(RunFolderTest, WhatIsKnownOfPrincipalPointsIsSaid) {
  OdometryRun run = MakeRun();
  WriteRunFolder(folder_, run);
  const auto points = [&] {
    return nlohmann::json::parse(ReadFile(folder_ + "/run.json"))["principal_points"];
  };
  EXPECT_TRUE(points().is_null());
  run.principal_points = PrincipalPoints{{Eigen::Vector2d(1.5, -2), Eigen::Vector2d(3, 4)},
                                         {Eigen::Vector2d(0.5, 0.25), Eigen::Vector2d(1, 2)}};
  WriteRunFolder(folder_, run);
  EXPECT_EQ(points()["left"]["offset_px"], nlohmann::json({1.5, -2.0}));
  EXPECT_EQ(points()["right"]["sigma_px"], nlohmann::json({1.0, 2.0}));
}

TEST_F(RunFolderTest, HowFarLinesDeviateComesBack) {
  OdometryRun run = MakeRun();
  run.line_deviation_rad = 0.002;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.line_deviation_rad, 0.002);
}

TEST_F(RunFolderTest, TheCalibrationIsThatOfSegmentsOfTheRun) {
  OdometryRun run = MakeRun();
  run.calibration[0].segment = 2;
  WriteRunFolder(folder_, run);
  ExpectReadError("calibration.csv: row 2: segment: found '2'",
                  "a segment that a state or a keyframe is of");
  // Of one of which nothing is left there is none.
  run.states.back().velocity_world_m_s.x() = kNaN;
  WriteRunFolder(folder_, run);
  EXPECT_TRUE(ReadRunFolder(folder_).calibration.empty());
}

TEST_F(RunFolderTest, SaysWhereItCameFrom) {
  WriteRunFolder(folder_, MakeRun());
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
  ASSERT_EQ(read.source->images.size(), 2u);
  EXPECT_EQ(read.source->images[0].right_path, "cam1/data/5.png");
  EXPECT_EQ(read.source->images[1].left_path, "cam0/data/6.png");
  EXPECT_EQ(read.source->images[1].right_path, "");
  ASSERT_EQ(read.imu.size(), 2u);
  EXPECT_EQ(read.imu[0].angular_velocity_rad_s.z(), 1.0 / 3);
  EXPECT_EQ(read.imu[1].specific_force_m_s2.z(), 1e-17);
}

TEST_F(RunFolderTest, HasAnIdThatIsThatOfItsContents) {
  WriteRunFolder(folder_, MakeRun());
  const std::string id = ReadRunFolder(folder_).id;
  EXPECT_EQ(id.size(), 16u);
  WriteRunFolder(folder_, MakeRun());
  EXPECT_EQ(RunIdIn(folder_), id);
  OdometryRun other = MakeRun();
  other.landmarks[0].p_world.x() += 0.25;
  WriteRunFolder(folder_, other);
  EXPECT_NE(RunIdIn(folder_), id);
}

TEST_F(RunFolderTest, EmptyRunComesBackEmpty) {
  OdometryRun run = MakeRun();
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

TEST_F(RunFolderTest, DropsAndCountsWhatIsNotFinite) {
  OdometryRun run = MakeRun();
  run.landmarks[1].p_world.y() = kNaN;
  run.landmarks[2].sigma_m = std::numeric_limits<double>::infinity();
  run.states[4].T_world_imu.translation.x() = 1e30;
  run.keyframes[0].observations[0].right_px->x() = kNaN;
  run.keyframes[1].T_world_imu.rotation.x() = kNaN;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.landmarks.size(), 1u);
  EXPECT_EQ(read.states.size(), 4u);
  EXPECT_EQ(read.warnings.at("landmarks_not_finite"), 2);
  EXPECT_EQ(read.warnings.at("states_not_finite"), 1);
  ASSERT_EQ(read.keyframes.size(), 1u);
  EXPECT_EQ(read.keyframes[0].observations.size(), 1u);
  EXPECT_EQ(read.warnings.at("keyframes_not_finite"), 1);
  EXPECT_EQ(read.warnings.at("observations_not_finite"), 1);
}

TEST_F(RunFolderTest, AFullDiskNamesTheFileAndLeavesTheOldRun) {
  WriteRunFolder(folder_, MakeRun());
  OdometryRun longer = MakeRun();
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
  EXPECT_THROW(WriteRunFolder(folder_, MakeRun()), OutputError);
}

TEST_F(RunFolderTest, MissingFilesAreNamed) {
  for (const char* name :
       {"trajectory.tum", "states.csv", "keyframes.csv", "observations.csv", "points.ply",
        "rig.json", "timings.json", "run.json", "imu.csv", "raw_rig.json", "options.yaml",
        "images.csv", "lines.ply", "calibration.csv"}) {
    std::filesystem::remove_all(folder_);
    WriteRunFolder(folder_, MakeRun());
    std::filesystem::remove(folder_ + "/" + name);
    ExpectReadError(name, folder_);
  }
}

// Makes row 2 of a table, the first below the columns, another one.
struct Damage {
  const char* file;
  const char* row;
  const char* message;
};

TEST_F(RunFolderTest, DamagedRowsAreNamed) {
  const std::string pose = ",0,0,0,0,0,0,1", rest = ",0,0,0,0,0,0,0,0,0";
  const std::string far = "3,0" + std::string(",1e30,0,0,0,0,0,1") + rest,
                    fast = "3,0" + pose + ",1e30,0,0,0,0,0,0,0,0",
                    late = "1403636579763555584,0" + pose + rest,
                    unit = "3,0,0,0,0,0.5,0.5,0,0.5" + rest, twice = "9,0,5" + pose;
  const Damage damages[] = {
      {"states.csv", far.c_str(), "x_m: found '1e30', expected -1000000 to 1000000"},
      {"states.csv", fast.c_str(), "vx_m_s: found '1e30'"},
      {"states.csv", unit.c_str(), "expected a quaternion of length 1"},
      {"states.csv", "3,-1", "found 2 columns, expected 18"},
      {"keyframes.csv", "-7,0,5,0,0,0,0,0,0,1", "id: found '-7', expected 0 to 2147483647"},
      {"observations.csv", "7,1,abc,2,nan,nan", "left_x_px: found 'abc', expected a finite number"},
      {"observations.csv", "7,1,nan,2,nan,nan", "left_x_px: found 'nan'"},
      {"observations.csv", "7,1,1e9,2,nan,nan", "left_x_px: found '1e9'"},
      {"observations.csv", "7,1,1,2,3,nan", "nan in all of the right image's columns or in none"},
      {"observations.csv", "8,1,1,2,nan,nan", "keyframe_id: found '8'"},
      {"imu.csv", "5,0,0,1e3,0,0,0", "wz_rad_s: found '1e3', expected -100 to 100"}};
  for (const Damage& damage : damages) {
    WriteRunFolder(folder_, MakeRun());
    std::string text = ReadFile(folder_ + "/" + damage.file);
    const std::size_t start = text.find('\n') + 1;
    text.replace(start, text.find('\n', start) - start, damage.row);
    WriteFile(folder_ + "/" + damage.file, text);
    ExpectReadError(std::string(damage.file) + ": row 2: ", damage.message);
    // The same where changes are accepted: values are checked in any case.
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr(damage.message)));
  }
  WriteRunFolder(folder_, MakeRun());
  WriteFile(folder_ + "/observations.csv", "a,b\n");
  ExpectReadError("observations.csv: row 1", "found the columns 'a,b'");
}

TEST_F(RunFolderTest, RowsThatContradictOthersAreNamed) {
  for (const auto& [file, what] :
       {std::pair("states.csv",
                  "stamp_ns: found '1403636579763555584', expected a stamp after "
                  "1403636579963555584"),
        std::pair("keyframes.csv", "id: found '7', expected an id that no row before it has"),
        std::pair("observations.csv", "landmark_id: found '1', expected an id that no row"),
        std::pair("imu.csv", "stamp_ns: found '5', expected a stamp after 6")}) {
    WriteRunFolder(folder_, MakeRun());
    const std::string path = folder_ + "/" + file, text = ReadFile(path);
    const std::size_t first = text.find('\n') + 1;
    WriteFile(path, text + text.substr(first, text.find('\n', first) + 1 - first));
    ExpectReadError(std::string(file) + ": row ", what);
  }
}

TEST_F(RunFolderTest, ChangedFilesAreRefusedUnlessAccepted) {
  WriteRunFolder(folder_, MakeRun());
  const std::string path = folder_ + "/observations.csv", text = ReadFile(path);
  WriteFile(path, text.substr(0, text.rfind("7,2,")));
  ExpectReadError(folder_ + ": found 1 observations, expected 2 as in run.json",
                  "--accept-changed");
  EXPECT_EQ(ReadRunFolder(folder_, {.accept_changed = true}).keyframes[0].observations.size(), 1u);
  std::string moved = text;
  moved.replace(text.find("10.5"), 4, "11.5");
  WriteFile(path, moved);
  ExpectReadError("observations.csv: found ", "expected ");
  WriteFile(path, text);
  // The file of another run does not belong here.
  OdometryRun other = MakeRun();
  other.landmarks[0].sigma_m = 0.25;
  WriteRunFolder(temp_.Path("other"), other);
  std::filesystem::copy_file(temp_.Path("other/points.ply"), folder_ + "/points.ply",
                             std::filesystem::copy_options::overwrite_existing);
  ExpectReadError("points.ply: found ", "as in run.json: written by another run or changed since");
}

// Runs of the same version from before it was estimated.
TEST_F(RunFolderTest, ARunWithoutItsCalibrationIsRead) {
  WriteRunFolder(folder_, MakeRun());
  std::filesystem::remove(folder_ + "/calibration.csv");
  EXPECT_TRUE(ReadRunFolder(folder_, {.accept_changed = true}).calibration.empty());
}

TEST_F(RunFolderTest, TheSummaryCountsPointsOfShortLives) {
  WriteRunFolder(folder_, MakeRun());
  const std::string text = ReadFile(folder_ + "/run.json");
  EXPECT_THAT(text, AllOf(HasSubstr("\"points\": 2"), HasSubstr("\"seen_once\": 2")));
}

TEST_F(RunFolderTest, AChangedSummaryIsRefused) {
  WriteRunFolder(folder_, MakeRun());
  const std::string path = folder_ + "/run.json", text = ReadFile(path);
  const auto change = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    changed.replace(text.find(from), from.size(), to);
    WriteFile(path, changed);
  };
  change("\"method\": \"points\"", "\"method\": \"plane\"");
  ExpectReadError("run.json: method: found 'plane'", "expected points-mono");
  change("\"imu_gap\": 2", "\"imu_gap\": -2");
  ExpectReadError("run.json: warnings: imu_gap: found -2", "at least 0");
  change("\"imu_gap\": 2", "\"imu_gap\": 3");
  ExpectReadError("run.json: found checksum", "--accept-changed");
  change("\"states\": 5", "\"states\": 6");
  ExpectReadError("found 5 states, expected 6", "run.json");
}

TEST_F(RunFolderTest, DamagedPlyAndJsonAreNamed) {
  WriteRunFolder(folder_, MakeRun());
  const std::string points = folder_ + "/points.ply";
  std::string bytes = ReadFile(points);
  bytes.resize(bytes.size() - 5);
  WriteFile(points, bytes);
  ExpectReadError("points.ply", "cut short: found 2 rows of element vertex, expected 3");

  WriteRunFolder(folder_, MakeRun());
  WriteFile(folder_ + "/rig.json", "{\"cameras\": [");
  ExpectReadError("rig.json: found no valid JSON at byte 14", "expected");
  WriteFile(folder_ + "/rig.json", "{\"cameras\": [1, 2]}");
  ExpectReadError("rig.json: found a value of a wrong type", "expected");
  WriteFile(folder_ + "/rig.json", "{}");
  ExpectReadError("rig.json: cameras: missing", "expected");
  for (const int version : {1, 2, 99}) {
    WriteFile(folder_ + "/run.json",
              "{\"format\": \"slcmap run\", \"version\": " + std::to_string(version) + "}");
    ExpectReadError("run.json",
                    "version " + std::to_string(version) + ", expected 'slcmap run' of version 4");
  }
}

TEST_F(RunFolderTest, AnAbsurdRigIsRefused) {
  WriteRunFolder(folder_, MakeRun());
  const std::string path = folder_ + "/rig.json", text = ReadFile(path);
  for (const auto& [from, to] :
       {std::pair("\"fx_px\": 458.5", "\"fx_px\": 0.0"),
        std::pair("\"fx_px\": 458.5", "\"fx_px\": -458.5"),
        std::pair("\"rate_hz\": 100", "\"rate_hz\": -100"),
        std::pair("\"camera_time_offset_s\": 0.0125", "\"camera_time_offset_s\": 1e9")}) {
    std::string damaged = text;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    damaged.replace(text.find(from), std::string(from).size(), to);
    WriteFile(path, damaged);
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("rig.json: "), HasSubstr("expected"))));
  }
}

}  // namespace
}  // namespace slcmap
