#include "mapping/map/point_index.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace slcmap::inline mapping {

struct DenseIndex::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> search;
};

DenseIndex::DenseIndex(const std::vector<DensePoint>& cloud) {
  if (cloud.empty()) return;
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const DensePoint& point : cloud) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    points->push_back({p.x(), p.y(), p.z()});
  }
  auto tree = std::make_unique<Tree>();
  tree->search.setInputCloud(points);
  tree_ = std::move(tree);
}

DenseIndex::~DenseIndex() = default;

void DenseIndex::Find(const Eigen::Vector3d& p_world, double radius_m,
                      std::vector<int>* found) const {
  found->clear();
  if (!tree_) return;
  const Eigen::Vector3f p = p_world.cast<float>();
  std::vector<float> squared;
  tree_->search.radiusSearch({p.x(), p.y(), p.z()}, radius_m, *found, squared);
}

}  // namespace slcmap::mapping
