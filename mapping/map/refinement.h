// Better poses for every image, from the keyframes that were optimised for longer and the IMU
// between them; and the world of a map: x and y along the building's main heading.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/io/trajectory.h"
#include "odometry/geometry/imu.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// A run's IMU for integration between poses that are already known well.
//
// Between keyframes some tenths of a second apart the IMU tells the way to a tenth of a millimetre
// once both ends are given: the speed at the start and the gyroscope's bias follow from them. What
// is left is a specific force that is off by a constant (the accelerometer's bias, the tilt): it
// bends the way by b (t - t_0) (t - t_1) / 2, which is nothing over a short time and too much over
// a long one. There the poses that odometry had between them tell it.
class InertialPath {
 public:
  explicit InertialPath(const OdometryRun& run);

  // Replaces the poses between the first and the last of `path`, which are those of two keyframes
  // and stay; the others are what is known without the IMU. All are T_world_imu with z up, stamps
  // are on the camera's clock and rise. `biases` is an online state near them. False, and nothing
  // is changed, where the IMU does not tell the way: the keyframes are too far apart in time, or
  // samples are missing.
  bool Follow(const OnlineState& biases, Trajectory* path) const;

 private:
  // Poses and speeds at the stamps, starting at the first pose at rest; none where samples are
  // missing.
  std::optional<Trajectory> Integrate(const OnlineState& biases, const Trajectory& path) const;

  // The IMU's true frame in that of the poses: samples are in the latter and
  // corrected, biases in the former.
  Eigen::Quaterniond R_given_true_ = Eigen::Quaterniond::Identity();
  ImuBuffer imu_;
  ImuNoise noise_;
  int64_t clock_ahead_ns_ = 0;  // of the IMU, against the camera's
};

// The online poses, each corrected as its neighbouring keyframes were corrected after they were
// first estimated. A keyframe's correction is C = T_world_keyframe T_world_online^-1; between the
// two keyframes around a pose (of its own segment) it is interpolated by time, beyond the first and
// last it is that of the nearest. Where the IMU tells the way between two keyframes it replaces
// this (InertialPath): online poses jump as the window changes, at keyframes above all. A segment
// of which no keyframe has the stamp of a state stays as it is, and its poses are counted in
// `warnings`. States are sorted by stamp.
Trajectory RefineTrajectory(const OdometryRun& run, std::map<std::string, int64_t>* warnings);

// The poses of the keyframes, sorted by stamp.
Trajectory KeyframeTrajectory(const std::vector<Keyframe>& keyframes);

// Turns all of a run about z so that the axes of the Manhattan world that most length of lines
// follows are x and y, by at most 45 degrees. Returns the turn, T_turned_run: none of a run that
// knows no heading, as of poses that were given, whose world somebody may have surveyed.
RigidTransform TurnAlongBuilding(OdometryRun* run);

}  // namespace slcmap::mapping
