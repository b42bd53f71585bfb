#include "mapping/views/views_between.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

namespace slcmap::inline mapping {
namespace {

constexpr double kAlike_m = 0.3;
constexpr double kAlike_rad = 0.35;

bool AreApart(const View& a, const View& b, const ViewSpacingOptions& options) {
  return (a.T_world_imu.translation - b.T_world_imu.translation).norm() >= options.min_travel_m ||
         a.T_world_imu.rotation.angularDistance(b.T_world_imu.rotation) >= options.min_turn_rad;
}

// Adds those between two keyframes that are apart from each other and from both.
void AddBetween(const Views& frames, size_t before, size_t after, const ViewSpacingOptions& options,
                std::vector<size_t>* selected) {
  size_t last = before;
  for (size_t i = before + 1; i < after; ++i) {
    if (!AreApart(frames[last], frames[i], options)) continue;
    if (!AreApart(frames[i], frames[after], options)) continue;
    selected->push_back(i);
    last = i;
  }
}

bool AreAlike(const View& a, const View& b) {
  return a.segment == b.segment && a.left_camera == b.left_camera &&
         (a.T_world_imu.translation - b.T_world_imu.translation).norm() <= kAlike_m &&
         a.T_world_imu.rotation.angularDistance(b.T_world_imu.rotation) <= kAlike_rad;
}

// The first ones stay, as these are next to each other: lines are swept in views that follow each
// other.
std::vector<size_t> WithoutAlike(const Views& frames, const std::vector<size_t>& selected,
                                 const ViewSpacingOptions& options) {
  std::vector<size_t> kept;
  for (const size_t i : selected) {
    const auto is_like = [&](size_t k) { return AreAlike(frames[k], frames[i]); };
    if (std::ranges::count_if(kept, is_like) < options.max_alike) kept.push_back(i);
  }
  return kept;
}

}  // namespace

std::vector<size_t> SelectViews(const Views& frames, const Views& keyframes,
                                const ViewSpacingOptions& options) {
  std::set<std::pair<int, int64_t>> is_keyframe;
  for (const View& keyframe : keyframes) is_keyframe.insert({keyframe.segment, keyframe.stamp_ns});
  std::vector<size_t> selected;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (!is_keyframe.contains({frames[i].segment, frames[i].stamp_ns})) continue;
    if (options.between_keyframes && !selected.empty()) {
      const size_t before = selected.back();
      if (frames[before].segment == frames[i].segment &&
          frames[before].left_camera == frames[i].left_camera) {
        AddBetween(frames, before, i, options, &selected);
      }
    }
    selected.push_back(i);
  }
  return WithoutAlike(frames, selected, options);
}

namespace {

using Eigen::Vector3d;

constexpr double kNear_s = 0.02;
constexpr int kLeastPoses = 20;
// Motion averages out to a small part of gravity; a frame that is another one's turns with the rig.
constexpr double kMostTilt_rad = 10 * std::numbers::pi / 180;

// The sample nearest in time; none where that is far. Samples are sorted.
const ImuSample* Nearest(const std::vector<ImuSample>& imu, int64_t stamp_ns) {
  const auto is_before = [](const ImuSample& sample, int64_t ns) { return sample.stamp_ns < ns; };
  const auto after = std::lower_bound(imu.begin(), imu.end(), stamp_ns, is_before);
  int64_t least_ns = ToNanoseconds(kNear_s);
  const ImuSample* nearest = nullptr;
  const auto consider = [&](const ImuSample& sample) {
    const int64_t off_ns = std::abs(sample.stamp_ns - stamp_ns);
    if (off_ns > least_ns) return;
    least_ns = off_ns;
    nearest = &sample;
  };
  if (after != imu.end()) consider(*after);
  if (after != imu.begin()) consider(*std::prev(after));
  return nearest;
}

}  // namespace

std::optional<Vector3d> MeanForceAt(const std::vector<OnlineState>& states,
                                    const std::vector<ImuSample>& imu,
                                    double camera_time_offset_s) {
  Vector3d sum = Vector3d::Zero();
  double norms_m_s2 = 0;
  int count = 0;
  for (const OnlineState& state : states) {
    const ImuSample* sample = Nearest(imu, state.stamp_ns + ToNanoseconds(camera_time_offset_s));
    if (!sample || !sample->specific_force_m_s2.allFinite()) continue;
    sum += state.T_world_imu.rotation * sample->specific_force_m_s2;
    norms_m_s2 += sample->specific_force_m_s2.norm();
    ++count;
  }
  if (count < kLeastPoses || norms_m_s2 < kLeastForce_m_s2 * count) return std::nullopt;
  return sum / count;
}

std::string WhatIsNotUp(const Vector3d& mean_force_m_s2) {
  const double norm_m_s2 = mean_force_m_s2.norm();
  if (norm_m_s2 < kLeastForce_m_s2) {
    return fmt::format(
        "the accelerometer's mean in the world of the poses is {:.1f} m/s^2, expected 9.8: are the "
        "poses those of the IMU, as T_world_imu, at the images' times?",
        norm_m_s2);
  }
  Vector3d up = mean_force_m_s2 / norm_m_s2;
  if (up.z() > std::cos(kMostTilt_rad)) return "";
  up = (100 * up).array().round() / 100 + 0.0;  // as it is told, without the sign of a zero
  return fmt::format(
      "by the accelerometer up is ({:.2f}, {:.2f}, {:.2f}) in the world of the poses, expected z: "
      "turn that world, or give poses of the IMU",
      up.x(), up.y(), up.z());
}

namespace {

constexpr double kMostStep_s = 0.5;
// Besides noise, as far as a rig that is carried or flies can accelerate.
constexpr double kMoved_m = 0.1, kAcceleration_m_s2 = 10;
constexpr double kTurned_rad = 0.1, kTurn_rad_s2 = 30;

struct Step {
  double duration_s;
  Eigen::Vector3d way_m;     // in the world
  Eigen::Vector3d turn_rad;  // in the body that it starts from
};

std::optional<Step> StepTo(const Trajectory& trajectory, size_t to) {
  if (to == 0 || to >= trajectory.size()) return std::nullopt;
  const StampedPose &a = trajectory[to - 1], &b = trajectory[to];
  const double duration_s = ToSeconds(b.stamp_ns - a.stamp_ns);
  if (!(duration_s > 0) || duration_s > kMostStep_s) return std::nullopt;
  return Step{duration_s, b.T_world_imu.translation - a.T_world_imu.translation,
              LogRotation(a.T_world_imu.rotation.conjugate() * b.T_world_imu.rotation)};
}

// What of a step is left when motion goes on as in another one.
PoseJump ComputeUnexplainedStep(const Step& step, const Step& motion) {
  const double share = step.duration_s / motion.duration_s;
  return {0, 0, (step.way_m - share * motion.way_m).norm(),
          ExpRotation(step.turn_rad).angularDistance(ExpRotation(share * motion.turn_rad))};
}

bool IsJump(const PoseJump& jump, const Step& step, const Step& motion) {
  // The velocities that are compared are of the middles of the steps.
  const double t2_s2 = step.duration_s * 0.5 * (step.duration_s + motion.duration_s);
  return jump.moved_m > kMoved_m + kAcceleration_m_s2 * t2_s2 ||
         jump.turned_rad > kTurned_rad + kTurn_rad_s2 * t2_s2;
}

}  // namespace

std::vector<PoseJump> FindJumps(const Trajectory& trajectory) {
  std::vector<PoseJump> jumps;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    const std::optional<Step> step = StepTo(trajectory, i);
    if (!step) continue;
    std::optional<PoseJump> least;
    bool is_jump = true;
    for (const std::optional<Step>& motion :
         {StepTo(trajectory, i - 1), StepTo(trajectory, i + 1)}) {
      if (!motion) continue;
      const PoseJump besides = ComputeUnexplainedStep(*step, *motion);
      is_jump = is_jump && IsJump(besides, *step, *motion);
      if (!least || besides.moved_m < least->moved_m) least = besides;
    }
    if (!least || !is_jump) continue;
    jumps.push_back(
        {trajectory[i - 1].stamp_ns, trajectory[i].stamp_ns, least->moved_m, least->turned_rad});
  }
  return jumps;
}

}  // namespace slcmap::mapping
