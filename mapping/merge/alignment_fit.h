// The level transform that brings one map onto another.
#pragma once

#include <optional>

#include "mapping/merge/map_agreement.h"

namespace slcmap {

struct AlignmentFit {
  RigidTransform T_first_second;
  int surfaces = 0, lines = 0;               // samples that were matched
  double surface_rms_m = 0, line_rms_m = 0;  // across, of these
};

struct AlignmentFitOptions {
  double from_m = 0.4, to_m = 0.06;  // across: what is matched, in the first step and in the last
  int steps = 12;
  int max_samples = 4000;  // of each kind, that are looked at
};

// Least squares over turn about z and translation, of distances from the nearest samples of the
// first: of surfaces along their normals, of lines across them, weighted by what is known of both,
// with Cauchy's loss. Matches are looked for again in each step. Nothing where they do not
// determine the transform.
std::optional<AlignmentFit> FitAlignment(const FeatureIndex& first, const AlignmentFeatures& second,
                                         const RigidTransform& start,
                                         const AlignmentFitOptions& options);

}  // namespace slcmap
