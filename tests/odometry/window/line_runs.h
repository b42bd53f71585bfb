// Simulated runs of the estimator in a building of lines, and how far they are off.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "data/core/math.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {

inline constexpr double kHeading_rad = 0.3;  // of the building

inline SimulatedRunOptions Building(Method method, double duration_s) {
  SimulatedRunOptions options;
  options.odometry.method = method;
  options.odometry.points.max_points = 60;
  options.duration_s = duration_s;
  options.stand_still_s = 1;
  // So many keyframes that short runs suffice.
  options.odometry.keyframes.min_parallax_px = 16;
  options.odometry.keyframes.min_kept_share = 0.7;
  options.lines = LineTrackSimulatorOptions{.heading_rad = kHeading_rad, .points_per_edge = 1};
  return options;
}

// Of all observations, and as the estimator believes it.
inline void SetPixelSigma(double sigma_px, SimulatedRunOptions* options) {
  options->pixel_sigma_px = sigma_px;
  options->odometry.window.point_sigma_px = options->odometry.line_landmarks.sigma_px = sigma_px;
}

inline SimulatedRunOptions NoisyLines(Method method, uint64_t seed, double duration_s = 10) {
  SimulatedRunOptions options = Building(method, duration_s);
  options.imu_noise = true;
  SetPixelSigma(0.5, &options);
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;  // as large as EuRoC's
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  options.seed = seed;
  return options;
}

// A share of the lines follows a slope of 31 degrees.
inline void AddStairs(double share, SimulatedRunOptions* options) {
  SetPixelSigma(0.3, options);
  options->lines->sloped_share = share;
  options->lines->slope_azimuth_rad = kHeading_rad;
  options->lines->slope_elevation_rad = 31 * kDegree;
}

// Root mean square errors over a run, once the first poses are laid together.
struct Errors {
  double position_m = 0, heading_rad = 0;
};

inline Errors GetErrors(const SimulatedRun& run) {
  const RigidTransform gauge = GaugeFromFirst(run);
  double position = 0, heading = 0;
  for (size_t i = 0; i < run.states.size(); ++i) {
    const RigidTransform estimate = gauge * run.states[i].T_world_imu;
    const Eigen::Quaterniond off = estimate.rotation * run.truth[i].rotation.conjugate();
    position += (estimate.translation - run.truth[i].translation).squaredNorm();
    heading += std::pow(LogRotation(off).z(), 2);
  }
  const auto count = static_cast<double>(run.states.size());
  return {std::sqrt(position / count), std::sqrt(heading / count)};
}

}  // namespace slcmap
