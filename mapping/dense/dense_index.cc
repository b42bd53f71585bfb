#include "mapping/dense/dense_index.h"

#include <pcl/point_cloud.h>

namespace slcmap {

DenseIndex::DenseIndex(const std::vector<DensePoint>& cloud) : is_empty_(cloud.empty()) {
  if (is_empty_) return;
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const DensePoint& point : cloud) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    points->push_back({p.x(), p.y(), p.z()});
  }
  tree_.setInputCloud(points);
}

void DenseIndex::Find(const Eigen::Vector3d& p_world, double radius_m,
                      std::vector<int>* found) const {
  found->clear();
  if (is_empty_) return;
  const Eigen::Vector3f p = p_world.cast<float>();
  std::vector<float> squared;
  tree_.radiusSearch({p.x(), p.y(), p.z()}, radius_m, *found, squared);
}

}  // namespace slcmap
