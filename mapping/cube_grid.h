// Space in cubes that have a key each, for what is looked up by where it is.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace slcmap {

inline Eigen::Vector3i CubeOf(const Eigen::Vector3d& p, double cube_m) {
  return (p / cube_m).array().floor().cast<int>();
}

// Cubes that are two million apart share one.
inline int64_t KeyOf(const Eigen::Vector3i& cube) {
  constexpr int64_t kMask = (1 << 21) - 1;
  return ((cube.x() & kMask) << 42) | ((cube.y() & kMask) << 21) | (cube.z() & kMask);
}

// A cube, and those that touch it: i from 0 to 26.
inline constexpr int kCubesAround = 27;
inline Eigen::Vector3i CubeAround(const Eigen::Vector3i& cube, int i) {
  return cube + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
}

}  // namespace slcmap
