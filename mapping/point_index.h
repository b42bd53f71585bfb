// Points by the cube of space that they are in.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "mapping/cube_grid.h"

namespace slcmap {

class PointIndex {
 public:
  explicit PointIndex(double cube_m) : cube_m_(cube_m) {}

  void Add(const Eigen::Vector3d& p, size_t item) {
    cubes_[KeyOf(CubeOf(p, cube_m_))].push_back({p, item});
  }

  // Whether what holds of any item within a distance, at most the edge of a cube.
  template <typename Holds>
  bool AnyNear(const Eigen::Vector3d& p, double distance_m, Holds holds) const {
    const Eigen::Vector3i middle = CubeOf(p, cube_m_);
    for (int i = 0; i < kCubesAround; ++i) {
      const auto found = cubes_.find(KeyOf(CubeAround(middle, i)));
      if (found == cubes_.end()) continue;
      for (const Entry& entry : found->second) {
        if ((entry.p - p).norm() <= distance_m && holds(entry.item)) return true;
      }
    }
    return false;
  }

  bool HasNear(const Eigen::Vector3d& p, double distance_m) const {
    return AnyNear(p, distance_m, [](size_t) { return true; });
  }

 private:
  struct Entry {
    Eigen::Vector3d p;
    size_t item = 0;
  };

  const double cube_m_;
  std::unordered_map<int64_t, std::vector<Entry>> cubes_;
};

}  // namespace slcmap
