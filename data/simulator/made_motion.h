// Made motions along waypoints: a walk with a rig in the hand, a robot, a flight.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/types.h"
#include "data/io/yaml.h"
#include "data/simulator/motion.h"

namespace slcmap::inline data {

enum class MotionKind {
  kWalk,    // bounces and sways with each step; the hand shakes
  kRobot,   // level, with the vibration of its drive
  kFlight,  // leans into its accelerations and drifts a little
};

// The section `trajectory` of a scene:
//
//   trajectory:
//     kind: walk            # walk, robot or flight
//     waypoints_m: [[0, 0, 1.6], [12, 0, 1.6], [12, 8, 1.6], [0, 0, 1.6]]   # of the left camera
//     speed_m_s: 1.2
struct MadeMotionOptions {
  MotionKind kind = MotionKind::kWalk;
  std::vector<Eigen::Vector3d> waypoints_m;  // of the left camera, in world
  double speed_m_s = 1.2;
  double corner_m = 0.8;       // how far before and behind a waypoint its corner is rounded
  double stand_still_s = 2.0;  // before the motion and after it
  double ease_s = 2.0;         // from rest to full speed
  double shake = 1.0;          // scale of bounce, sway, shake and vibration
  bool face_start = true;      // where it ends at its start, it turns to its first direction
  uint64_t seed = 1;

  void Check(const std::string& place = "trajectory") const;  // throws ConfigError
  void Read(YamlSection section);
};

// The motion of the rig's IMU whose left camera looks along the way, the world's up at the top of
// its image. It begins and ends at rest. Throws ConfigError where it would last more than
// kMaxMotion_s, and StoppedError where progress ends it.
MotionSpline MakeMotion(const MadeMotionOptions& options, const Rig& rig,
                        const Progress& progress = {});

// The way covered since a start from rest, in units of the full speed times seconds: a smooth step
// of ease_s in speed. 0 before t_s = 0.
double EasedTime(double t_s, double ease_s);

}  // namespace slcmap::data
