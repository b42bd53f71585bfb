// What the estimator makes of simulated tracks: error and consistency against the noise.
//
//   estimator_on_tracks [--method M] [--moving] [--seconds S] [--runs N] [--sigma PX]
//       [--lines N [--deviation DEG [--edges-per-object N]] [--points-per-edge N]
//       [--crossings-per-edge N] [--scatter M] [--sloped-share S]] [--config YAML]
//
// With lines, a part of them holds landmarks (that all methods see), and places where nearer edges
// cross them, which slide: what memberships of points in lines give, and what wrong ones cost.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "data/core/math.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

double ApeAfterGauge(const SimulatedRun& run) {
  const RigidTransform gauge = GaugeFromFirst(run);
  double sum = 0;
  for (size_t i = 0; i < run.states.size(); ++i) {
    sum += (gauge * run.states[i].T_world_imu.translation - run.truth[i].translation).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(run.states.size()));
}

// Memberships at the end of the run of lines, and those of points that are not on the edge.
std::pair<size_t, size_t> Memberships(const SimulatedRun& run) {
  size_t all = 0, wrong = 0;
  for (const Line& line : run.run.lines) {
    const std::vector<int64_t>& members = run.edges.at(static_cast<size_t>(line.id)).landmarks;
    for (const int64_t id : line.point_ids) {
      ++all;
      wrong += std::find(members.begin(), members.end(), id) == members.end();
    }
  }
  return {all, wrong};
}

// Errors of the calibration, each with the standard deviation that is claimed.
void PrintCalibration(const SimulatedRun& run) {
  constexpr double kDegrees = 180 / M_PI;
  const auto print = [&](const char* name, const char* unit, int row, int count, double scale) {
    std::printf("  %s [%s]", name, unit);
    for (int i = row; i < row + count; ++i) {
      std::printf(" %+.4f (%.4f)", scale * run.calibration_error[i],
                  scale * run.calibration_sigma[i]);
    }
  };
  print("time", "ms", kRowTimeOffset, 1, 1e3);
  print("IMU", "deg", kRowImuRotation, 3, kDegrees);
  print("lever", "mm", kRowLever, 3, 1e3);
  print("right", "deg", kImuCalibrationSize + kRowRightRotation, 3, kDegrees);
  print("focal length", "%", kImuCalibrationSize + kRowFocalLength, 1, 100);
  print("accelerometer", "%", kRowErrors + kErrorAccelScale, 3, 100);
  print("axes", "deg", kRowErrors + kErrorAccelAxes, 3, kDegrees);
  print("gyroscope", "%", kRowErrors + kErrorGyroScale, 3, 100);
  print("axes", "deg", kRowErrors + kErrorGyroAxes, 6, kDegrees);
  const int estimated = static_cast<int>((run.calibration_sigma.array() > 1e-6).count());
  std::printf("  NEES %.1f / %d\n", run.calibration_nees, estimated);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  using namespace slcmap;
  CLI::App app("Estimator on simulated tracks");
  SimulatedRunOptions options;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.5;
  options.duration_s = 40;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  int runs = 5;
  int max_points = 0;
  bool moving = false;
  std::string config, method;
  LineTrackSimulatorOptions lines;
  lines.heading_rad = 0.3;
  lines.max_lines = 0;
  app.add_option("--config", config);
  app.add_option("--seconds", options.duration_s);
  app.add_option("--runs", runs);
  app.add_option("--sigma", options.pixel_sigma_px);
  app.add_option("--method", method);
  app.add_option("--points", max_points, "in a frame, beside those on lines");
  app.add_option("--lines", lines.max_lines, "in a frame");
  double deviation_deg = 0;
  app.add_option("--deviation", deviation_deg, "of the edges' directions from the axes");
  app.add_option("--edges-per-object", lines.edges_per_object, "that share their deviation");
  app.add_option("--points-per-edge", lines.points_per_edge);
  app.add_option("--crossings-per-edge", lines.crossings_per_edge);
  app.add_option("--scatter", lines.scatter_m);
  app.add_option("--sloped-share", lines.sloped_share, "of the edges, that share a slope");
  app.add_flag("--moving", moving);
  double late_ms = 0, imu_turn_deg = 0, right_turn_deg = 0;
  app.add_option("--late-ms", late_ms, "stamps of the images");
  app.add_option("--imu-turn-deg", imu_turn_deg, "claimed of the IMU, about an axis askew");
  app.add_option("--right-turn-deg", right_turn_deg, "claimed of the right camera, about x and y");
  app.add_option("--focal-length", options.fault.focal_length, "share claimed too much");
  double imu_scale = 0, imu_axes_deg = 0;
  app.add_option("--imu-scale", imu_scale, "share by which both sensors read too much");
  app.add_option("--imu-axes-deg", imu_axes_deg, "by which their axes are off");
  CLI11_PARSE(app, argc, argv);
  if (!config.empty()) options.odometry = OdometryOptions::FromYaml(config);
  options.odometry.window.point_sigma_px = options.pixel_sigma_px;
  options.odometry.line_landmarks.sigma_px = options.pixel_sigma_px;
  if (max_points > 0) options.odometry.points.max_points = max_points;
  if (!method.empty()) options.odometry.method = MethodFromName(method);
  lines.deviation_rad = deviation_deg * M_PI / 180;
  if (lines.max_lines > 0) options.lines = lines;
  if (moving) options.stand_still_s = 0;
  options.fault.stamps_late_ns = ToNanoseconds(1e-3 * late_ms);
  options.fault.imu_rotation_rad = imu_turn_deg * kDegree * Eigen::Vector3d(2, -1, 2) / 3;
  const auto scale = Eigen::Vector3d::Constant(1 / (1 + imu_scale) - 1);
  options.fault.imu_errors << scale, imu_axes_deg * kDegree * Eigen::Vector3d(1, -1, 1), scale,
      imu_axes_deg * kDegree * Eigen::Vector<double, 6>(1, -1, -1, 1, 1, -1);
  options.fault.right_rotation_rad = right_turn_deg * kDegree * Eigen::Vector3d(1, 1, 0);
  double ape = 0, nees = 0, nees_yaw_pos = 0, nees_heading = 0, calibration_nees = 0;
  double nees_slope = 0;
  int slopes = 0;
  for (int i = 0; i < runs; ++i) {
    options.seed = 10 + i;
    const auto start = std::chrono::steady_clock::now();
    const SimulatedRun run = RunOnSimulatedTracks(options);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    const auto [members, wrong] = Memberships(run);
    std::printf(
        "run %d: %zu states, %zu keyframes, APE %.4f m, largest %.4f m, removed %zu, segments %d, "
        "%.2f ms/frame, NEES pose %.1f / 6, all %.1f / 15, memberships %zu, wrong %zu, "
        "heading off %.4f deg, sigma %.4f, lines off their axes by %.3f deg\n",
        i, run.states.size(), run.run.keyframes.size(), ApeAfterGauge(run),
        LargestPositionError(run), run.removed_points, run.states.back().segment,
        1e3 * spent.count() / (options.duration_s * 20), run.final_pose_nees, run.final_nees,
        members, wrong, run.final_heading_error_rad * 180 / M_PI,
        run.final_heading_sigma_rad * 180 / M_PI, run.run.line_deviation_rad * 180 / M_PI);
    if (run.final_heading_sigma_rad > 0) {
      const double off = run.final_heading_error_rad / run.final_heading_sigma_rad;
      nees_heading += off * off / runs;
    }
    if (run.final_slope_nees > 0) {
      const Eigen::Vector2d error = run.final_slope_error_rad / kDegree,
                            sigma = run.final_slope_sigma_rad / kDegree;
      std::printf("  slope off by %+.4f (%.4f) %+.4f (%.4f) deg, NEES %.1f / 2, of %zu found\n",
                  error[0], sigma[0], error[1], sigma[1], run.final_slope_nees,
                  run.run.sloped_directions.size());
      nees_slope += run.final_slope_nees;
      ++slopes;
    }
    PrintCalibration(run);
    calibration_nees += run.calibration_nees / runs;
    ape += ApeAfterGauge(run) / runs;
    nees += run.final_nees / runs;
    nees_yaw_pos += run.final_pose_nees / runs;
  }
  std::printf(
      "mean APE %.4f m, NEES pose %.2f / 6, all %.2f / 15, heading %.2f / 1, calibration %.2f / "
      "11\n",
      ape, nees_yaw_pos, nees, nees_heading, calibration_nees);
  if (slopes > 0) std::printf("slope NEES %.2f / 2 (%d runs)\n", nees_slope / slopes, slopes);
}
