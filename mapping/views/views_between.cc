#include "mapping/views/views_between.h"

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
  return selected;
}

}  // namespace slcmap
