// A stereo rig that walks towards some edges and sees them all, exactly: runs and trajectories for
// the tests of measures, without images.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "data/io/ply.h"
#include "odometry/run/run.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

inline constexpr double kWalkStep_s = 0.5, kWalkStep_m = 0.05;

inline Rig WalkRig() {
  Rig rig;
  rig.cameras.assign(2, PinholeCamera(752, 480, 450, 375.5, 239.5));
  rig.T_imu_camera[1].translation.x() = 0.11;
  return rig;
}

// The IMU's axes are those of the left camera, which looks along the world's x.
inline Trajectory Walk(int poses) {
  Eigen::Matrix3d rotation;
  rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Trajectory walk;
  for (int i = 0; i < poses; ++i) {
    walk.push_back(
        {ToNanoseconds(kWalkStep_s * i), {Eigen::Quaterniond(rotation), {kWalkStep_m * i, 0, 0}}});
  }
  return walk;
}

// Across the view, 2.6 to 2.9 m from the start: upright ones, and one that leans, so that stereo
// places them.
inline std::vector<PlySegment> WalkEdges() {
  return {{{2.6, -0.8, -0.5}, {2.6, -0.8, 0.6}},
          {{2.6, 0.1, -0.5}, {2.6, 0.1, 0.6}},
          {{2.9, 0.9, -0.5}, {2.9, 0.9, 0.6}},
          {{2.6, -0.8, -0.4}, {2.6, 0.8, 0.5}}};
}

// A run whose keyframes, at the poses, see all edges; line i is edge i.
inline OdometryRun RunOver(const Trajectory& walk) {
  OdometryRun run;
  run.method = "slc";
  run.complete = true;
  run.rectified_rig = WalkRig();
  for (const StampedPose& pose : walk) {
    Keyframe keyframe;
    keyframe.id = static_cast<int64_t>(run.keyframes.size());
    keyframe.stamp_ns = pose.stamp_ns;
    keyframe.T_world_imu = pose.T_world_imu;
    for (const PlySegment& edge : WalkEdges()) {
      std::array<LineSegment, 2> seen;
      for (size_t c = 0; c < 2; ++c) {
        const RigidTransform T_camera_world =
            (pose.T_world_imu * run.rectified_rig.T_imu_camera[c]).Inverse();
        const Camera& camera = run.rectified_rig.cameras[c];
        seen[c] = {*camera.Project(T_camera_world * edge.start_world),
                   *camera.Project(T_camera_world * edge.end_world)};
      }
      keyframe.lines.push_back({static_cast<int64_t>(keyframe.lines.size()), seen[0], seen[1]});
    }
    run.keyframes.push_back(keyframe);
    OnlineState state;
    state.stamp_ns = pose.stamp_ns;
    state.T_world_imu = pose.T_world_imu;
    run.states.push_back(state);
  }
  return run;
}

}  // namespace slcmap::testing
