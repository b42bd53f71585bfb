// Labels that cost least, inside or outside, by a minimum cut.
#pragma once

#include <cstddef>
#include <vector>

namespace slcmap {

// What it costs to label a thing by itself.
struct LabelCosts {
  double inside = 0, outside = 0;
};

// What it costs to label two things differently.
struct PairCost {
  size_t a = 0, b = 0;
  double cost = 0;
};

// The labels of least cost in all, true: inside. Costs are not negative. Y. Boykov and
// V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization
// in vision", PAMI 2004.
std::vector<bool> LeastCostLabels(const std::vector<LabelCosts>& things,
                                  const std::vector<PairCost>& pairs);

}  // namespace slcmap
