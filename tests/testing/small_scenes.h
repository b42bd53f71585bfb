// Scenes of a few surfaces and rigs that hardly move, for tests of the renderer's parts.
#pragma once

#include "data/simulator/scene/scene.h"
#include "data/simulator/sequence_writer.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

// The world as seen by a camera at its origin that looks along x with z up: y is to its left.
inline RigidTransform LookingAlongX() {
  return {CameraLookingAlong(Eigen::Vector3d::UnitX()), Eigen::Vector3d::Zero()};
}

// A quarter of EuRoC's resolution; the left camera is the body, the right one 0.1 m to its right.
inline Rig SmallRig(Distortion distortion) {
  Camera camera = PinholeCamera(188, 120, 114.5, 91.4, 61.7);
  camera.distortion = distortion;
  if (distortion == Distortion::kRadialTangential) camera.coefficients << -0.283, 0.074, 2e-4, 2e-5;
  if (distortion == Distortion::kEquidistant) camera.coefficients << -0.01, 0.002, 0, 0;
  Rig rig;
  rig.cameras = {camera, camera};
  rig.T_imu_camera[1].translation = {0.1, 0, 0};
  return rig;
}

// A motion of 2 s at constant velocity that is at T_world_imu after 1 s; frames 0, 1, ... from
// there on, 50 ms apart.
inline RenderTask SlidingTask(const Rig& rig, const RigidTransform& T_world_imu,
                              const Eigen::Vector3d& velocity_m_s, int frames) {
  constexpr double kKnot_s = 0.1;
  std::vector<RigidTransform> control;
  for (int j = 0; j < 26; ++j) {
    const double t_s = (j - 2) * kKnot_s - 1;
    control.emplace_back(T_world_imu.rotation, T_world_imu.translation + t_s * velocity_m_s);
  }
  RenderTask task{rig, MotionSpline(kKnot_s, control), {}};
  for (int f = 0; f < frames; ++f) task.times_s.push_back(1 + 0.05 * f);
  return task;
}

// A wall across the view at the distance x_m, in light from everywhere: bright to the left of y = 0
// and dark to the right of it (or above and below z = 0).
inline Scene TwoToneWall(float x_m, bool upright, float bright, float dark) {
  Scene scene;
  scene.ambient = 1;
  scene.materials = {{TextureKind::kPlain, bright, 0, 1}, {TextureKind::kPlain, dark, 0, 1}};
  const Eigen::Vector3f across = upright ? Eigen::Vector3f(0, 30, 0) : Eigen::Vector3f(0, 0, 30);
  const Eigen::Vector3f along = upright ? Eigen::Vector3f(0, 0, 60) : Eigen::Vector3f(0, 60, 0);
  const Eigen::Vector3f a = Eigen::Vector3f(x_m, 0, 0) - 0.5f * along;
  scene.quads = {{a, across, along, 0, {0, 0}}, {a, -across, along, 1, {0, 0}}};
  return scene;
}

}  // namespace slcmap::testing
