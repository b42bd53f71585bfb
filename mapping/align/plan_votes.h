// Where one map may lie in another: all places of its plan, by how much falls on its like.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/align/map_agreement.h"

namespace slcmap::inline mapping {

// A turn of the second map, and the heading of the first that becomes x.
struct PlanTurn {
  double yaw_rad = 0, heading_rad = 0;
};

// Those that bring a heading of the second onto one of the first, up to quarter turns; with a rough
// start those within its reach.
std::vector<PlanTurn> FindTurns(const AlignmentFeatures& first, const AlignmentFeatures& second,
                                const AlignmentOptions& options);

// Shifts in height that bring most of what faces up, of what faces down, and of level lines of the
// second onto the first's, the best first; with a rough start those within its reach.
std::vector<double> FindHeights(const AlignmentFeatures& first, const AlignmentFeatures& second,
                                const AlignmentOptions& options);

// A place of the second map in the first, to be looked at closely.
struct AlignmentCandidate {
  RigidTransform T_first_second;
  double votes = 0;
};

// The places with most votes, the best first: for each turn by which a heading of the second is
// brought onto one of the first, upright lines, level lines and surfaces by where they face vote
// for shifts in the plan (a correlation), and level surfaces and lines for heights. With a rough
// start those within its reach. None where a map has no heading. Throws StoppedError once progress
// says so.
std::vector<AlignmentCandidate> FindCandidates(const AlignmentFeatures& first,
                                               const AlignmentFeatures& second,
                                               const AlignmentOptions& options,
                                               const Progress& progress = {});

}  // namespace slcmap::mapping
