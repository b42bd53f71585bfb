// Angles, quantiles and intervals. Angles are radians everywhere but in files and in what people
// read; lines have no sense of direction.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace slcmap::inline data {

inline constexpr double kDegree = std::numbers::pi / 180;  // in radians
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

// From 0 to pi / 2, exact for small angles too. The directions may have any length.
inline double LineAngle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

// Of a normal distribution: the standard deviation over the median of absolute values.
inline constexpr double kSigmaOfMedian = 1.4826;

// The nearest of the values; 0 where there are none.
inline double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// What lies between two places along a line.

struct Interval {
  double from_m = 0, to_m = 0;

  double length_m() const { return to_m - from_m; }
};

// What two stretches share; where they are apart its length is less than 0, by the gap.
inline Interval Common(const Interval& a, const Interval& b) {
  return {std::max(a.from_m, b.from_m), std::min(a.to_m, b.to_m)};
}

inline double TotalLength_m(const std::vector<Interval>& stretches) {
  double length_m = 0;
  for (const Interval& stretch : stretches) length_m += stretch.length_m();
  return length_m;
}

}  // namespace slcmap::data
