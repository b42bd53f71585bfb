// What lies between two places along a line.
#pragma once

#include <algorithm>
#include <vector>

namespace slcmap {

struct Stretch {
  double from_m = 0, to_m = 0;

  double length_m() const { return to_m - from_m; }
};

// What two stretches share; where they are apart its length is less than 0, by the gap.
inline Stretch Common(const Stretch& a, const Stretch& b) {
  return {std::max(a.from_m, b.from_m), std::min(a.to_m, b.to_m)};
}

inline double TotalLength_m(const std::vector<Stretch>& stretches) {
  double length_m = 0;
  for (const Stretch& stretch : stretches) length_m += stretch.length_m();
  return length_m;
}

}  // namespace slcmap
