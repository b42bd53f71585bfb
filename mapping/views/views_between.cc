#include "mapping/views/views_between.h"

#include <algorithm>
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
