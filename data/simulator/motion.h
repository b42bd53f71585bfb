// A smooth motion with exact derivatives: what a simulated rig does, and what an IMU measures along
// it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/core/progress.h"
#include "data/core/rigid_transform.h"
#include "data/core/types.h"
#include "data/io/trajectory.h"

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

}  // namespace slcmap::data
