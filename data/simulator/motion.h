// A smooth motion with exact derivatives: what a simulated rig does, and what an IMU measures along
// it.
// Made motions along waypoints: a walk with a rig in the hand, a robot, a flight.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/core/rigid_transform.h"
#include "data/core/types.h"
#include "data/io/trajectory.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {

// A uniform quintic B-spline, its rotation cumulative on SO(3) (Kim, Kim and Shin, "A general
// construction scheme for unit quaternion curves", 1995; Sommer et al., "Efficient derivative
// computation for cumulative B-splines on Lie groups", 2020). Four times continuously
// differentiable.
//
// Times are seconds since the start of the motion and are clamped to [0, Duration()].
class MotionSpline {
 public:
  static constexpr int kOrder = 6;  // control poses that shape one instant

  // control[j] has its greatest weight at the time (j - 2) * knot_interval_s. At least kOrder of
  // them. Throws DataError when there are fewer, or when the interval is not positive.
  MotionSpline(double knot_interval_s, const std::vector<RigidTransform>& T_world_imu_control);

  double Duration() const { return end_s_ - begin_s_; }

  // The motion from a time on, for a duration or to its end. Throws DataError where nothing is
  // left.
  MotionSpline Slice(double from_s, double duration_s) const;

  RigidTransform PoseAt(double t_s) const;              // T_world_imu
  Eigen::Vector3d VelocityAt(double t_s) const;         // in world, m/s
  Eigen::Vector3d AccelerationAt(double t_s) const;     // in world, m/s^2, without gravity
  Eigen::Vector3d AngularVelocityAt(double t_s) const;  // in imu, rad/s

 private:
  struct Place {
    size_t first;  // control pose
    double u;      // in [0, 1]
  };
  Place Locate(double t_s) const;
  Eigen::Vector3d PositionDerivative(double t_s, int derivative) const;

  struct Rotation;
  Rotation RotationAt(double t_s) const;

  double knot_interval_s_;
  double begin_s_, end_s_;  // since the first knot
  std::vector<RigidTransform> control_;
  std::vector<Eigen::Vector3d> increments_rad_;  // Log(R_j^-1 R_{j+1})
};

// The rotation of a camera that looks along `forward_world` with the world's up at its top.
Eigen::Quaterniond CameraLookingAlong(const Eigen::Vector3d& forward_world);

struct MotionFitOptions {
  // Weight of the squared third differences of the control poses against the squared errors. It
  // bridges gaps of the trajectory and keeps its jitter out of the acceleration.
  double smoothing = 0.05;
  void Check() const;  // throws ConfigError
};

struct MotionFit {
  MotionSpline motion;
  double position_rms_m = 0, position_max_m = 0;
  double rotation_rms_rad = 0, rotation_max_rad = 0;
};

// The motion nearest to a trajectory by least squares; its time 0 is the trajectory's first stamp.
// Throws DataError on a trajectory of less than two poses or of more than kMaxMotion_s, and
// StoppedError where progress ends it.
MotionFit FitMotion(const Trajectory& trajectory, const MotionFitOptions& options = {},
                    const Progress& progress = {});

inline constexpr double kMaxMotion_s = 4 * 3600;  // of a motion that is simulated

struct ImuSimulatorOptions {
  ImuNoise noise;
  bool with_noise = true;  // false: exact values; the initial biases below still hold, and stay
  Eigen::Vector3d initial_gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d initial_accel_bias_m_s2 = Eigen::Vector3d::Zero();
  int64_t start_stamp_ns = 0;  // of the motion's time 0
  uint64_t seed = 1;
  void Check() const;  // throws ConfigError
};

struct ImuBias {
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

struct SimulatedImu {
  std::vector<ImuSample> samples;
  std::vector<ImuBias> biases;  // the true one at each sample
};

// Samples at the rate of the noise model over the whole motion. Each is the value at the instant of
// its stamp, plus its bias, plus white noise of density * sqrt(rate); biases walk by density /
// sqrt(rate) from one sample to the next (Kalibr's discrete model).
// Throws ConfigError where these are more than some hours give, and StoppedError where progress
// ends it.
SimulatedImu SimulateImu(const MotionSpline& motion, const ImuSimulatorOptions& options,
                         const Progress& progress = {});

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
