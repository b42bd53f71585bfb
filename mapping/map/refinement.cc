#include "mapping/map/refinement.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "data/core/rigid_transform.h"
#include "odometry/factors/imu_factor.h"

namespace slcmap::inline mapping {
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
      run.calibration.empty() ? ImuCorrection() : MakeCorrection(run.calibration.back().imu_errors);
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

namespace {

// By stamp, what a keyframe's optimisation changed: T_world_final = correction * T_world_online.
using Corrections = std::map<int64_t, RigidTransform>;

std::map<int, Corrections> CorrectionsOfSegments(const std::vector<OnlineState>& states,
                                                 const std::vector<Keyframe>& keyframes) {
  std::map<int64_t, const OnlineState*> by_stamp;
  for (const OnlineState& state : states) by_stamp[state.stamp_ns] = &state;
  std::map<int, Corrections> corrections;
  for (const Keyframe& keyframe : keyframes) {
    const auto state = by_stamp.find(keyframe.stamp_ns);
    if (state == by_stamp.end() || state->second->segment != keyframe.segment) continue;
    corrections[keyframe.segment][keyframe.stamp_ns] =
        keyframe.T_world_imu * state->second->T_world_imu.Inverse();
  }
  return corrections;
}

// `corrections` holds at least one.
RigidTransform CorrectionAt(const Corrections& corrections, int64_t stamp_ns) {
  const auto after = corrections.lower_bound(stamp_ns);
  if (after == corrections.end()) return corrections.rbegin()->second;
  if (after == corrections.begin() || after->first == stamp_ns) return after->second;
  const auto before = std::prev(after);
  const double u = static_cast<double>(stamp_ns - before->first) /
                   static_cast<double>(after->first - before->first);
  return Interpolate(before->second, after->second, u);
}

// Where the states of a keyframe and of the next of its segment are, as indices. States whose
// segment changes in between are not among them.
using Span = std::pair<size_t, size_t>;

std::vector<Span> SpansBetweenKeyframes(const std::vector<OnlineState>& states,
                                        const std::map<int, Corrections>& corrections) {
  std::vector<Span> spans;
  const size_t none = states.size();
  size_t previous = none;
  for (size_t i = 0; i < states.size(); ++i) {
    if (previous != none && states[previous].segment != states[i].segment) previous = none;
    const auto segment = corrections.find(states[i].segment);
    if (segment == corrections.end() || !segment->second.contains(states[i].stamp_ns)) continue;
    if (previous != none) spans.emplace_back(previous, i);
    previous = i;
  }
  return spans;
}

void FollowImu(const OdometryRun& run, const std::vector<Span>& spans, Trajectory* trajectory) {
  const InertialPath imu(run);
  for (const auto& [first, last] : spans) {
    const auto begin = trajectory->begin() + static_cast<std::ptrdiff_t>(first);
    Trajectory path(begin, trajectory->begin() + static_cast<std::ptrdiff_t>(last) + 1);
    if (imu.Follow(run.states[last], &path)) std::copy(path.begin(), path.end(), begin);
  }
}

}  // namespace

Trajectory RefineTrajectory(const OdometryRun& run, std::map<std::string, int64_t>* warnings) {
  const std::map<int, Corrections> corrections = CorrectionsOfSegments(run.states, run.keyframes);
  Trajectory trajectory;
  int64_t unrefined = 0;
  for (const OnlineState& state : run.states) {
    const auto segment = corrections.find(state.segment);
    const bool known = segment != corrections.end();
    unrefined += !known;
    const RigidTransform correction =
        known ? CorrectionAt(segment->second, state.stamp_ns) : RigidTransform();
    trajectory.push_back({state.stamp_ns, correction * state.T_world_imu});
  }
  FollowImu(run, SpansBetweenKeyframes(run.states, corrections), &trajectory);
  if (unrefined > 0) {
    (*warnings)["poses not refined: no keyframe of their segment has the stamp of a state"] +=
        unrefined;
    spdlog::warn(
        "{} of {} poses not refined: no keyframe of their segment has the stamp of a state",
        unrefined, run.states.size());
  }
  return trajectory;
}

Trajectory KeyframeTrajectory(const std::vector<Keyframe>& keyframes) {
  std::map<int64_t, RigidTransform> by_stamp;
  for (const Keyframe& keyframe : keyframes) by_stamp[keyframe.stamp_ns] = keyframe.T_world_imu;
  Trajectory trajectory;
  for (const auto& [stamp_ns, T_world_imu] : by_stamp)
    trajectory.push_back({stamp_ns, T_world_imu});
  return trajectory;
}

namespace {

bool IsLevel(const Line& line) { return line.axis == LineAxis::kX || line.axis == LineAxis::kY; }

std::optional<double> MainHeading(const OdometryRun& run) {
  std::vector<double> lengths_m(run.manhattan_worlds.size(), 0);
  for (const Line& line : run.lines) {
    if (!IsLevel(line) || line.world < 0 || line.world >= std::ssize(lengths_m)) continue;
    lengths_m[static_cast<size_t>(line.world)] += (line.end_world - line.start_world).norm();
  }
  std::optional<size_t> main;
  for (size_t i = 0; i < lengths_m.size(); ++i) {
    if (run.manhattan_worlds[i].withdrawn) continue;
    if (!main || lengths_m[i] > lengths_m[*main]) main = i;
  }
  if (!main) return std::nullopt;
  return run.manhattan_worlds[*main].heading_rad;
}

// X and Y of a world are interchangeable: its heading stays in (-pi/4, pi/4], and the lines of a
// world whose heading would leave that change axes.
void TurnHeadings(double yaw_rad, OdometryRun* run) {
  constexpr double kSquare_rad = 0.5 * M_PI;
  std::vector<bool> are_swapped;
  for (ManhattanWorld& world : run->manhattan_worlds) {
    const double turned_rad = world.heading_rad + yaw_rad;
    const double squares = std::ceil(turned_rad / kSquare_rad - 0.5);
    world.heading_rad = turned_rad - squares * kSquare_rad;
    are_swapped.push_back(std::fmod(squares, 2) != 0);
  }
  for (Line& line : run->lines) {
    if (!IsLevel(line) || line.world < 0 || line.world >= std::ssize(are_swapped)) continue;
    if (!are_swapped[static_cast<size_t>(line.world)]) continue;
    line.axis = line.axis == LineAxis::kX ? LineAxis::kY : LineAxis::kX;
  }
  for (SlopedDirection& slope : run->sloped_directions) {
    slope.azimuth_rad = std::remainder(slope.azimuth_rad + yaw_rad, 2 * M_PI);
  }
}

void TurnContents(const RigidTransform& T, OdometryRun* run) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (OnlineState& state : run->states) {
    state.T_world_imu = T * state.T_world_imu;
    state.velocity_world_m_s = R * state.velocity_world_m_s;
  }
  for (Keyframe& keyframe : run->keyframes) keyframe.T_world_imu = T * keyframe.T_world_imu;
  for (Landmark& landmark : run->landmarks) landmark.p_world = T * landmark.p_world;
  for (Line& line : run->lines) {
    line.start_world = T * line.start_world;
    line.end_world = T * line.end_world;
    line.covariance_m2 = R * line.covariance_m2 * R.transpose();
  }
}

}  // namespace

RigidTransform TurnAlongBuilding(OdometryRun* run) {
  const std::optional<double> heading_rad = MainHeading(*run);
  if (!heading_rad) return {};
  const RigidTransform T_turned_run{ExpRotation({0, 0, -*heading_rad}), Eigen::Vector3d::Zero()};
  TurnHeadings(-*heading_rad, run);
  TurnContents(T_turned_run, run);
  return T_turned_run;
}

}  // namespace slcmap::mapping
