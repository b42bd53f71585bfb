// The points of a dense cloud about a place.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "mapping/dense/dense_point.h"

namespace slcmap {

class DenseIndex {
 public:
  explicit DenseIndex(const std::vector<DensePoint>& cloud);
  ~DenseIndex();

  // The indices of those within radius_m of a place (world, m), the nearest first.
  void Find(const Eigen::Vector3d& p_world, double radius_m, std::vector<int>* found) const;

 private:
  // Whoever includes this has no need of PCL: it is no dependency of the installed package.
  struct Tree;
  std::unique_ptr<const Tree> tree_;  // null where the cloud is empty
};

}  // namespace slcmap
