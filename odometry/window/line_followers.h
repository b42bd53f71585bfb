// Lines that follow a heading or a slope of their window.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <map>
#include <string>
#include <unordered_set>
#include <vector>

#include "odometry/window/line_landmarks.h"

namespace slcmap {

// Withdraws those of the window's headings or slopes that most of their lines were given up for,
// and retires the rest of these lines. `followed` is what of a line names the one that it follows,
// `name` what the log calls one. Returns the ids of the retired lines.
template <typename Options, typename State, typename States, typename Name>
std::unordered_set<int64_t> WithdrawFollowed(const Options& options, State* LineLandmark::*followed,
                                             States* states, const Name& name,
                                             WindowState* window) {
  std::map<const State*, std::vector<LineLandmark*>> followers;
  for (auto& [id, line] : window->lines) {
    if (line.estimated && !line.retired && line.*followed)
      followers[line.*followed].push_back(&line);
  }
  std::unordered_set<int64_t> retired;
  for (State& state : *states) {
    const int given_up = state.lines_given_up;
    const int all = state.lines_kept + given_up + static_cast<int>(followers[&state].size());
    if (state.withdrawn || given_up < options.min_given_up ||
        given_up < options.max_given_up_share * all) {
      continue;
    }
    spdlog::warn("withdrew {}: {} of {} lines are off it", name(state), given_up, all);
    state.withdrawn = true;
    for (LineLandmark* line : followers[&state]) {
      Retire(line);
      retired.insert(line->id);
    }
  }
  return retired;
}

}  // namespace slcmap
