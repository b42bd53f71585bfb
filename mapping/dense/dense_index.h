// The points of a dense cloud about a place.
#pragma once

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <vector>

#include "mapping/dense/dense_point.h"

namespace slcmap {

class DenseIndex {
 public:
  explicit DenseIndex(const std::vector<DensePoint>& cloud);

  // The indices of those within radius_m of a place (world, m), the nearest first.
  void Find(const Eigen::Vector3d& p_world, double radius_m, std::vector<int>* found) const;

 private:
  bool is_empty_;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
};

}  // namespace slcmap
