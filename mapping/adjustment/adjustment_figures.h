#pragma once

#include <cstdint>

namespace slcmap {

// What an adjustment was made of, and how it went.
struct AdjustmentFigures {
  int64_t keyframes = 0, points = 0, point_observations = 0, lines = 0, line_observations = 0;
  int64_t rejected_point_observations = 0, rejected_line_observations = 0;
  int64_t closures = 0, closures_taken_back = 0;  // found, and of these
  int64_t matched_points = 0, matched_edges = 0;  // of those that stayed
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;  // half the robustified sum of squares
};

}  // namespace slcmap
