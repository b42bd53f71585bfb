// The value below which a share of others lies.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace slcmap {

// Of a normal distribution: the standard deviation over the median of absolute values.
inline constexpr double kSigmaOfMedian = 1.4826;

// The nearest of the values; 0 where there are none.
inline double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace slcmap
