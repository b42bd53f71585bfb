// Points, also of a dense cloud, by where they are: space in cubes that have a key each.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "mapping/map/map.h"

namespace slcmap::inline mapping {

inline Eigen::Vector3i FindCube(const Eigen::Vector3d& p, double cube_m) {
  return (p / cube_m).array().floor().cast<int>();
}

// Cubes that are two million apart share one.
inline int64_t MakeKey(const Eigen::Vector3i& cube) {
  constexpr int64_t kMask = (1 << 21) - 1;
  return ((cube.x() & kMask) << 42) | ((cube.y() & kMask) << 21) | (cube.z() & kMask);
}

// A cube, and those that touch it: i from 0 to 26.
inline constexpr int kCubesAround = 27;
inline Eigen::Vector3i CubeAround(const Eigen::Vector3i& cube, int i) {
  return cube + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
}

// Points by the cube of space that they are in.

class PointIndex {
 public:
  explicit PointIndex(double cube_m) : cube_m_(cube_m) {}

  void Add(const Eigen::Vector3d& p, size_t item) {
    cubes_[MakeKey(FindCube(p, cube_m_))].push_back({p, item});
  }

  // Whether what holds of any item within a distance, at most the edge of a cube.
  template <typename Holds>
  bool AnyNear(const Eigen::Vector3d& p, double distance_m, Holds holds) const {
    const Eigen::Vector3i middle = FindCube(p, cube_m_);
    for (int i = 0; i < kCubesAround; ++i) {
      const auto found = cubes_.find(MakeKey(CubeAround(middle, i)));
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

// Points by PCL's k-d tree.

class PointTree {
 public:
  explicit PointTree(const std::vector<Eigen::Vector3f>& points);
  explicit PointTree(const std::vector<DensePoint>& cloud);
  ~PointTree();

  // Indices of points, the nearest first.
  struct Found {
    std::vector<int> items;
    std::vector<float> squared_m2;
  };
  void FindNearest(const Eigen::Vector3f& p, int count, Found* found) const;
  void FindWithin(const Eigen::Vector3f& p, double radius_m, Found* found) const;

 private:
  // Whoever includes this has no need of PCL: it is no dependency of the installed package.
  struct Tree;
  std::unique_ptr<const Tree> tree_;  // null where there are no points
};

}  // namespace slcmap::mapping
