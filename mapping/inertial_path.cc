#include "mapping/inertial_path.h"

#include "data/rigid_transform.h"
#include "odometry/imu/preintegration.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Longer ways are known better by odometry: random walk and tilt grow with the time.
constexpr double kMaxDuration_s = 1.5;
constexpr double kMaxGap_s = 0.025;
// What the specific force is off by, constantly; and how far odometry's poses between two keyframes
// are off the way between them.
constexpr double kForceSigma_m_s2 = 0.01, kOnlineSigma_m = 0.001;
// An IMU that misses the other keyframe by more has a fault, or its biases are not known yet. Over
// a short time a difference from odometry's poses is their jump.
constexpr double kMaxTurnError_rad_s = 0.02, kMaxForceError_m_s2 = 0.3, kShort_s = 0.5;

// Turns so that the last rotation becomes `last`, more the later. False, and nothing is turned,
// where that is by too much.
bool CloseRotation(const Eigen::Quaterniond& last, Trajectory* path) {
  const Vector3d missing = LogRotation(path->back().T_world_imu.rotation.conjugate() * last);
  const int64_t start_ns = path->front().stamp_ns;
  const double duration_s = ToSeconds(path->back().stamp_ns - start_ns);
  if (missing.norm() > kMaxTurnError_rad_s * duration_s) return false;
  for (StampedPose& pose : *path) {
    const double u = ToSeconds(pose.stamp_ns - start_ns) / duration_s;
    pose.T_world_imu.rotation = (pose.T_world_imu.rotation * ExpRotation(u * missing)).normalized();
  }
  return true;
}

// Adds the starting velocity that leads to `last`.
void ClosePosition(const Vector3d& last, Trajectory* path) {
  const int64_t start_ns = path->front().stamp_ns;
  const Vector3d velocity_m_s =
      (last - path->back().T_world_imu.translation) / ToSeconds(path->back().stamp_ns - start_ns);
  for (StampedPose& pose : *path) {
    pose.T_world_imu.translation += ToSeconds(pose.stamp_ns - start_ns) * velocity_m_s;
  }
}

// How far a specific force that is off by 1 m/s^2 bends the way, by pose.
std::vector<double> Bends(const Trajectory& path) {
  std::vector<double> bends;
  for (const StampedPose& pose : path) {
    bends.push_back(0.5 * ToSeconds(pose.stamp_ns - path.front().stamp_ns) *
                    ToSeconds(pose.stamp_ns - path.back().stamp_ns));
  }
  return bends;
}

// The constant error of the specific force by which `online` differs from the way (least squares).
Vector3d ForceError(const std::vector<double>& bends, const Trajectory& online,
                    const Trajectory& path) {
  Vector3d sum = Vector3d::Zero();
  double squares = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    sum += bends[i] * (online[i].T_world_imu.translation - path[i].T_world_imu.translation);
    squares += bends[i] * bends[i];
  }
  if (squares <= 0) return Vector3d::Zero();
  return sum / squares;
}

// How far that is to be believed: weighed against its being zero.
double Belief(double duration_s) {
  const double sagitta_m = kForceSigma_m_s2 * duration_s * duration_s / 8;
  return sagitta_m * sagitta_m / (sagitta_m * sagitta_m + kOnlineSigma_m * kOnlineSigma_m);
}

}  // namespace

InertialPath::InertialPath(const OdometryRun& run) : noise_(run.rectified_rig.imu_noise) {
  clock_ahead_ns_ = ToNanoseconds(run.rectified_rig.camera_time_offset_s);
  if (!run.calibration.empty()) {
    clock_ahead_ns_ += ToNanoseconds(run.calibration.back().time_offset_s);
    R_given_true_ = ExpRotation(run.calibration.back().imu_rotation_rad);
  }
  const ImuCorrection correction =
      run.calibration.empty() ? ImuCorrection() : CorrectionOf(run.calibration.back().imu_errors);
  for (const ImuSample& sample : run.imu) {
    imu_.Add({sample.stamp_ns, R_given_true_ * (correction.gyro * sample.angular_velocity_rad_s),
              R_given_true_ * (correction.accel * sample.specific_force_m_s2)});
  }
}

std::optional<Trajectory> InertialPath::Integrate(const OnlineState& biases,
                                                  const Trajectory& path) const {
  const int64_t first_ns = path.front().stamp_ns + clock_ahead_ns_;
  const int64_t last_ns = path.back().stamp_ns + clock_ahead_ns_;
  if (imu_.empty() || imu_.first_stamp_ns() > first_ns || !imu_.Covers(last_ns) ||
      imu_.LongestGap(first_ns, last_ns) > kMaxGap_s) {
    return std::nullopt;
  }
  const RigidTransform& start = path.front().T_world_imu;
  const Vector3d gyro_bias_rad_s = R_given_true_ * biases.gyro_bias_rad_s;
  const Vector3d accel_bias_m_s2 = R_given_true_ * biases.accel_bias_m_s2;
  Preintegration motion(noise_, gyro_bias_rad_s, accel_bias_m_s2);
  Trajectory integrated{path.front()};
  for (size_t i = 1; i < path.size(); ++i) {
    std::vector<ImuSample> samples =
        imu_.Between(path[i - 1].stamp_ns + clock_ahead_ns_, path[i].stamp_ns + clock_ahead_ns_);
    for (size_t k = i > 1 ? 1 : 0; k < samples.size(); ++k) motion.Append(samples[k]);
    const Preintegration::Motion moved = motion.CorrectedFor(gyro_bias_rad_s, accel_bias_m_s2);
    const double t_s = motion.duration_s();
    const Vector3d fallen_m(0, 0, -0.5 * kGravity_m_s2 * t_s * t_s);
    integrated.push_back(
        {path[i].stamp_ns, {start.rotation * moved.rotation, start * moved.position_m + fallen_m}});
  }
  return integrated;
}

bool InertialPath::Follow(const OnlineState& biases, Trajectory* path) const {
  if (path->size() < 3) return false;
  const double duration_s = ToSeconds(path->back().stamp_ns - path->front().stamp_ns);
  if (duration_s > kMaxDuration_s) return false;
  std::optional<Trajectory> integrated = Integrate(biases, *path);
  if (!integrated || !CloseRotation(path->back().T_world_imu.rotation, &*integrated)) return false;
  ClosePosition(path->back().T_world_imu.translation, &*integrated);
  const std::vector<double> bends = Bends(*integrated);
  const Vector3d force_m_s2 = ForceError(bends, *path, *integrated);
  if (duration_s > kShort_s && force_m_s2.norm() > kMaxForceError_m_s2) return false;
  const Vector3d error_m_s2 = Belief(duration_s) * force_m_s2;
  for (size_t i = 1; i + 1 < path->size(); ++i) {
    RigidTransform& pose = (*path)[i].T_world_imu;
    pose = (*integrated)[i].T_world_imu;
    pose.translation += bends[i] * error_m_s2;
  }
  return true;
}

}  // namespace slcmap
