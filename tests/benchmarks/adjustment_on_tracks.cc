// What the adjustment makes of simulated tracks: error of online, window's and adjusted poses.
//
//   adjustment_on_tracks [--seconds S] [--runs N] [--sigma PX] [--lines N [--deviation DEG]]
//       [--late-ms MS] [--right-turn-deg DEG] [--focal-length SHARE] [--no-imu-noise]
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "mapping/adjustment/adjustment.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

// RMSE of the keyframes' positions, once the first poses are laid together.
double Ape(const SimulatedRun& run, const std::vector<RigidTransform>& T_world_imu,
           const CalibrationFault& fault) {
  const auto truth = [&](size_t k) {
    return run.motion->PoseAt(ToSeconds(run.run.keyframes[k].stamp_ns - fault.stamps_late_ns));
  };
  const RigidTransform gauge = GaugeBetween(truth(0), T_world_imu[0]);
  double sum = 0;
  for (size_t k = 0; k < T_world_imu.size(); ++k) {
    sum += (gauge * T_world_imu[k].translation - truth(k).translation).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(T_world_imu.size()));
}

// What an OdometryRun holds beside what the estimator describes.
void Complete(const SimulatedRunOptions& options, SimulatedRun* run) {
  run->run.rectified_rig = options.fault.Claimed(run->rig);
  run->run.imu = run->imu.samples;
  run->run.states = run->states;
}

void PrintCalibration(const CalibrationEstimate& c, const CalibrationVector& truth) {
  constexpr double kDeg = 180 / M_PI;
  const auto right = kImuCalibrationSize + kRowRightRotation;
  std::printf(
      "  off: time %+.3f (%.3f) ms, right x %+.4f (%.4f) y %+.4f (%.4f) deg, focal %+.4f "
      "(%.4f) %%\n",
      1e3 * (c.time_offset_s - truth[kRowTimeOffset]), 1e3 * c.time_offset_sigma_s,
      kDeg * (c.right_rotation_rad.x() - truth[right]), kDeg * c.right_rotation_sigma_rad.x(),
      kDeg * (c.right_rotation_rad.y() - truth[right + 1]), kDeg * c.right_rotation_sigma_rad.y(),
      100 * (c.focal_length - truth[kImuCalibrationSize + kRowFocalLength]),
      100 * c.focal_length_sigma);
}

void Measure(const SimulatedRunOptions& options, const AdjustmentOptions& adjustment) {
  SimulatedRun run = RunOnSimulatedTracks(options);
  Complete(options, &run);
  std::vector<RigidTransform> online, window;
  for (const Keyframe& keyframe : run.run.keyframes) {
    window.push_back(keyframe.T_world_imu);
    const auto state = std::ranges::find(run.states, keyframe.stamp_ns, &OnlineState::stamp_ns);
    online.push_back(state != run.states.end() ? state->T_world_imu : keyframe.T_world_imu);
  }
  const auto start = std::chrono::steady_clock::now();
  const AdjustmentResult result = Adjust(run.run, adjustment);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  if (!result.usable) {
    std::printf("not usable: %s\n", result.reason.c_str());
    return;
  }
  std::printf(
      "%zu keyframes, %ld points, %ld lines: online %.5f, window %.5f, adjusted %.5f m, %d "
      "iterations, %.2f s\n",
      window.size(), result.figures.points, result.figures.lines, Ape(run, online, options.fault),
      Ape(run, window, options.fault), Ape(run, result.T_world_imu, options.fault),
      result.figures.iterations, spent.count());
  if (result.calibration) PrintCalibration(*result.calibration, options.fault.Expected());
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  using namespace slcmap;
  CLI::App app("Adjustment of simulated tracks");
  SimulatedRunOptions options;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.25;
  options.duration_s = 40;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  int runs = 3;
  LineTrackSimulatorOptions lines;
  lines.heading_rad = 0.3;
  lines.max_lines = 0;
  double deviation_deg = 0, late_ms = 0, right_turn_deg = 0;
  bool no_imu_noise = false;
  app.add_option("--seconds", options.duration_s);
  app.add_option("--runs", runs);
  app.add_option("--sigma", options.pixel_sigma_px);
  app.add_option("--lines", lines.max_lines, "in a frame");
  app.add_option("--deviation", deviation_deg, "of the edges' directions from the axes");
  app.add_option("--late-ms", late_ms, "stamps of the images");
  app.add_option("--right-turn-deg", right_turn_deg, "claimed of the right camera, about x and y");
  app.add_option("--focal-length", options.fault.focal_length, "share claimed too much");
  app.add_flag("--no-imu-noise", no_imu_noise);
  CLI11_PARSE(app, argc, argv);
  options.imu_noise = !no_imu_noise;
  AdjustmentOptions adjustment;
  if (options.pixel_sigma_px > 0) {
    options.odometry.window.point_sigma_px = options.pixel_sigma_px;
    options.odometry.line_landmarks.sigma_px = options.pixel_sigma_px;
    adjustment.point_sigma_px = adjustment.line_sigma_px = options.pixel_sigma_px;
  }
  lines.deviation_rad = deviation_deg * M_PI / 180;
  if (lines.max_lines > 0) options.lines = lines;
  options.fault.stamps_late_ns = ToNanoseconds(1e-3 * late_ms);
  options.fault.right_rotation_rad = right_turn_deg * M_PI / 180 * Eigen::Vector3d(1, 1, 0);
  for (int i = 0; i < runs; ++i) {
    options.seed = 10 + i;
    Measure(options, adjustment);
  }
}
