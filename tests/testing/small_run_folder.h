// A folder for a small run, for tests of what writes and reads it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "data/core/error.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

// A run of two keyframes, three landmarks and three lines in two segments, cut short.
inline OdometryRun MakeSmallRun() {
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

}  // namespace slcmap::testing
