// Folds states and landmarks that leave the window into the prior.
#pragma once

#include <vector>

#include "odometry/window/problem_builder.h"

namespace slcmap {

// The prior on the remaining blocks that is left of `prior` and `terms` once `dropped` (state
// blocks) and every landmark that the terms speak of are marginalised. In square-root form:
// landmarks are removed by projection on the null space of their columns, states by a QR
// decomposition (Demmel et al., "Square Root Marginalization for Sliding-Window Bundle Adjustment",
// ICCV 2021).
//
// Blocks without a linearisation point are linearised at their current values; the returned prior's
// x_lin says where each was. Robust losses enter as weights at the current residuals.
Prior Marginalize(const std::vector<Term>& terms, const Prior& prior,
                  const std::vector<double*>& dropped);

}  // namespace slcmap
