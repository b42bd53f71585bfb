// The value below which a share of others lies.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace slcmap {

// The nearest of the values; 0 where there are none.
inline double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

}  // namespace slcmap
