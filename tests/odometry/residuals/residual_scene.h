// A line before a camera, for the tests of residuals of lines.
#pragma once

#include <gtest/gtest.h>

#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "tests/odometry/residuals/factor_test_utils.h"
#include "tests/testing/example.h"

namespace slcmap {

using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr double kHeading = 0.37;
inline constexpr LineAxis kAxes[] = {LineAxis::kX, LineAxis::kY, LineAxis::kVertical};

struct LineScene {
  StereoGeometry geometry{ExampleStereoRig().T_imu_camera, 450.0};
  RigidTransform pose{ExpRotation({0.1, -0.4, 2.0}), {1, 2, 3}};
  Vector3d anchor{0.9, 1.7, 3.2};
  StereoLineMeasurement off{{{0.3, -0.1}, {-0.2, 0.25}}, LineSegment{{0.2, -0.12}, {-0.3, 0.2}}};

  // A point that the left camera sees.
  Vector3d Visible() const { return pose * (geometry.T_imu_camera[0] * Vector3d(0.6, -0.3, 3.5)); }
  Vector2d Seen(const Vector3d& p_world, int camera) const {
    const Vector3d p = (pose * geometry.T_imu_camera[camera]).Inverse() * p_world;
    return p.head<2>() / p.z();
  }
};

inline Blocks StructuralBlocks(const LineScene& scene, const StructuralLine& line) {
  const StructuralLineBlock block = StructuralLineThrough(line, kHeading, scene.Visible());
  if (!line.HasHeading()) return {PoseBlockOf(scene.pose), {block[0], block[1]}};
  return {PoseBlockOf(scene.pose), {kHeading}, {block[0], block[1]}};
}

inline Blocks FreeLineBlocks(const LineScene& scene, const Vector3d& direction) {
  const GeneralLineBlock line = GeneralLineThrough(scene.anchor, scene.Visible(), direction);
  return {PoseBlockOf(scene.pose), {line.begin(), line.end()}};
}

}  // namespace slcmap
