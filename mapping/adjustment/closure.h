// Places that were visited twice, and what was recognised there.
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/adjustment/adjustment_state.h"
#include "mapping/adjustment/agreement.h"

namespace slcmap {

// A point of an earlier visit that a keyframe of a later one sees; indices into the state.
struct PointMatch {
  size_t point = 0;
  size_t frame = 0;
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  // on the plane z = 1
};

// Two lines that are one edge, seen at an earlier and at a later visit.
struct EdgeMatch {
  size_t older = 0, newer = 0;
};

struct Closure {
  size_t older_frame = 0, newer_frame = 0;  // of the visits, one keyframe each
  Shift shift = Shift::Zero();              // of the later visit, as the matches have it
  std::vector<PointMatch> points;
  std::vector<EdgeMatch> edges;
  bool taken_back = false;
};

// Lengths of the path up to each keyframe, from the start of its segment.
std::vector<double> PathLengths(const AdjustmentState& state);

// What odometry leaves open over a path of some length.
ShiftSigma SigmaOver(double path_m, const ClosureOptions& options);

// Whether the votes for a shift are so many, and so many more than those for another.
bool IsUnique(const Agreement& agreement, int min_votes, const ClosureOptions& options);

}  // namespace slcmap
