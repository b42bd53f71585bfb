// A line along X before a stereo rig, for tests of single lines in a window.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "odometry/window/problem.h"
#include "tests/testing/example.h"

namespace slcmap::testing {

// The line lies across the view of a rig that moves aslant. Cameras are level.
class LineScene : public ::testing::Test {
 protected:
  static constexpr int64_t kLine = 7;
  static constexpr double kDepth_m = 3;
  static constexpr double kFocal_px = 450;

  // Sets the cost model, and the line as it is.
  void MakeLine(double sigma_px, HeadingState* heading, LineLandmark* line) {
    model_.geometry = StereoGeometry(rig_.T_imu_camera, kFocal_px / 0.4);
    model_.lines = StereoGeometry(rig_.T_imu_camera, kFocal_px / sigma_px);
    line->id = kLine;
    line->axis = LineAxis::kX;
    line->heading = heading;
    line->anchor_world = T_world_camera_.translation;
    line->estimated = true;
    const StructuralLineBlock block = StructuralLineThrough(line->structural(), 0, At(0));
    std::copy(block.begin(), block.end(), line->block.begin());
  }

  // Adds frame i to the window, which sees the line as it is.
  FrameState* AddFrame(int i, LineLandmark* line) {
    FrameState* frame = window_.frames.emplace_back(std::make_unique<FrameState>()).get();
    frame->id = i;
    PoseToBlock(Pose(i), frame->pose.data());
    frame->lines[kLine] = ObservationOf(i);
    line->frames.push_back(frame);
    return frame;
  }

  // A point of the world below the line's middle.
  Eigen::Vector3d At(double below_m) const {
    return T_world_camera_ * Eigen::Vector3d(0, below_m, kDepth_m);
  }

  RigidTransform Pose(int i) const {
    return RigidTransform(Eigen::Quaterniond::Identity(),
                          R_world_camera_ * Eigen::Vector3d(0.15 * i, 0.15 * i, 0)) *
           T_world_camera_ * rig_.T_imu_camera[0].Inverse();
  }

  Eigen::Vector2d OnPlane(int i, int camera, const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d p = (Pose(i) * rig_.T_imu_camera[camera]).Inverse() * p_world;
    return p.head<2>() / p.z();
  }

  StereoLineMeasurement ObservationOf(int i) const {
    const Eigen::Vector3d start = At(0) - Eigen::Vector3d::UnitX();
    const Eigen::Vector3d end = At(0) + Eigen::Vector3d::UnitX();
    return {{OnPlane(i, 0, start), OnPlane(i, 0, end)},
            LineSegment{OnPlane(i, 1, start), OnPlane(i, 1, end)}};
  }

  const Rig rig_ = ExampleStereoRig();
  const Eigen::Quaterniond R_world_camera_ = Eigen::Quaterniond(
      Eigen::Matrix3d((Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished()));
  const RigidTransform T_world_camera_{R_world_camera_, Eigen::Vector3d(1, 2, 1.5)};
  CostModel model_;
  WindowState window_;
};

}  // namespace slcmap::testing
