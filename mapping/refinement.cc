#include "mapping/refinement.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "mapping/inertial_path.h"

namespace slcmap {
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
  std::optional<size_t> previous;
  for (size_t i = 0; i < states.size(); ++i) {
    if (previous && states[*previous].segment != states[i].segment) previous.reset();
    const auto segment = corrections.find(states[i].segment);
    if (segment == corrections.end() || !segment->second.contains(states[i].stamp_ns)) continue;
    if (previous) spans.emplace_back(*previous, i);
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

}  // namespace slcmap
