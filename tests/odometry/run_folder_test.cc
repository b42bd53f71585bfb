#include "odometry/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

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

TEST_F(RunFolderTest, EmptyRunComesBackEmpty) {
  OdometryRun run = MakeRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
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
  run.states[4].T_world_imu.translation.x() = kNaN;
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
      const testing::FileSizeLimit full(name == "run.json" ? bytes - 1 : bytes / 2);
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
  for (const char* name : {"trajectory.tum", "states.csv", "keyframes.csv", "observations.csv",
                           "points.ply", "rig.json", "timings.json", "run.json"}) {
    WriteRunFolder(folder_, MakeRun());
    std::filesystem::remove(folder_ + "/" + name);
    ExpectReadError(name, folder_);
  }
}

TEST_F(RunFolderTest, DamagedTablesNameTheRow) {
  WriteRunFolder(folder_, MakeRun());
  const std::string observations = folder_ + "/observations.csv";
  const std::string good = ReadFile(observations);
  WriteFile(observations, good + "7,1,abc,2,nan,nan\n");
  ExpectReadError("observations.csv: row 4", "left_x_px: found 'abc'");
  WriteFile(observations, good + "7,1,nan,2,nan,nan\n");
  ExpectReadError("observations.csv: row 4", "finite number");
  WriteFile(observations, good + "8,1,1,2,nan,nan\n");
  ExpectReadError("observations.csv: row 4", "keyframe_id: found '8'");
  WriteFile(observations, good + "7,1,1\n");
  ExpectReadError("observations.csv: row 4", "found 3 columns, expected 6");
  WriteFile(observations, "a,b\n");
  ExpectReadError("observations.csv: row 1", "found the columns 'a,b'");
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
  WriteFile(folder_ + "/run.json", "{\"format\": \"slcmap run\", \"version\": 99}");
  ExpectReadError("run.json", "version 99");
}

}  // namespace
}  // namespace slcmap
