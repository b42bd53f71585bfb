#include "tests/testing/example.h"

#include <algorithm>
#include <cmath>

#include "data/simulator/motion.h"

namespace slcmap {
namespace {

// Rounds of changing size and height; it never stops, so that the way ahead is always defined.
Eigen::Vector3d FlightPosition(double t_s) {
  const double turn_rad = 0.35 * t_s;
  return {(3.4 + 0.6 * std::sin(0.23 * t_s)) * std::sin(turn_rad),
          (2.5 + 0.5 * std::sin(0.31 * t_s)) * std::cos(turn_rad), 0.75 * std::sin(0.57 * t_s)};
}

Eigen::Quaterniond FlightSwing(double t_s) {
  return ExpRotation(
      {0.12 * std::sin(2.1 * t_s), 0.10 * std::sin(1.3 * t_s), 0.14 * std::sin(1.7 * t_s)});
}

}  // namespace

Rig ExampleStereoRig() {
  Rig rig;
  Camera camera;
  camera.width_px = 752;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 435;
  camera.cx_px = 375.5;
  camera.cy_px = 239.5;
  rig.cameras = {camera, camera};
  Eigen::Matrix4d T_imu_left;
  T_imu_left << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
      0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,  //
      -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949, 0, 0, 0, 1;
  rig.T_imu_camera[0] = RigidTransformFromMatrix(T_imu_left, "example rig");
  rig.T_imu_camera[1] =
      rig.T_imu_camera[0] * RigidTransform(Eigen::Quaterniond::Identity(), {0.11, 0, 0});
  return rig;
}

MotionSpline ExampleFlight(const Rig& rig, double duration_s, double stand_still_s) {
  constexpr double kKnot_s = 0.1;
  const Eigen::Quaterniond R_camera_imu = rig.T_imu_camera[0].rotation.conjugate();
  std::vector<RigidTransform> control;
  const int segments = std::max(1, static_cast<int>(std::ceil(duration_s / kKnot_s)));
  for (int j = 0; j < segments + MotionSpline::kOrder - 1; ++j) {
    const double t_s = EasedTime((j - 2) * kKnot_s - stand_still_s, 2.0);
    const Eigen::Vector3d position = FlightPosition(t_s);
    Eigen::Vector3d ahead = FlightPosition(t_s + 0.8) - position;
    ahead.z() *= 0.5;
    control.emplace_back(CameraLookingAlong(ahead) * FlightSwing(t_s) * R_camera_imu, position);
  }
  return MotionSpline(kKnot_s, control);
}

}  // namespace slcmap
