#include "mapping/views/views_between.h"

#include <algorithm>
#include <set>
#include <utility>

namespace slcmap {
namespace {

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

bool AreAlike(const View& a, const View& b, const ViewSpacingOptions& options) {
  return a.segment == b.segment &&
         (a.T_world_imu.translation - b.T_world_imu.translation).norm() <= options.alike_m &&
         a.T_world_imu.rotation.angularDistance(b.T_world_imu.rotation) <= options.alike_rad;
}

// The first ones stay, as these are next to each other: lines are swept in views that follow each
// other.
std::vector<size_t> WithoutAlike(const Views& frames, const std::vector<size_t>& selected,
                                 const ViewSpacingOptions& options) {
  std::vector<size_t> kept;
  for (const size_t i : selected) {
    const auto is_like = [&](size_t k) { return AreAlike(frames[k], frames[i], options); };
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
      if (frames[before].segment == frames[i].segment) {
        AddBetween(frames, before, i, options, &selected);
      }
    }
    selected.push_back(i);
  }
  return WithoutAlike(frames, selected, options);
}

}  // namespace slcmap
