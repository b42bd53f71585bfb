#include "mapping/map/point_index.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace slcmap::inline mapping {

struct PointTree::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> search;
};

namespace {

std::vector<Eigen::Vector3f> DensePlaces(const std::vector<DensePoint>& cloud) {
  std::vector<Eigen::Vector3f> places;
  for (const DensePoint& point : cloud) places.push_back(point.p_world.cast<float>());
  return places;
}

}  // namespace

PointTree::PointTree(const std::vector<Eigen::Vector3f>& points) {
  if (points.empty()) return;
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3f& p : points) cloud->push_back({p.x(), p.y(), p.z()});
  auto tree = std::make_unique<Tree>();
  tree->search.setInputCloud(cloud);
  tree_ = std::move(tree);
}

PointTree::PointTree(const std::vector<DensePoint>& cloud) : PointTree(DensePlaces(cloud)) {}

PointTree::~PointTree() = default;

void PointTree::FindNearest(const Eigen::Vector3f& p, int count, Found* found) const {
  found->items.clear();
  found->squared_m2.clear();
  if (!tree_) return;
  tree_->search.nearestKSearch({p.x(), p.y(), p.z()}, count, found->items, found->squared_m2);
}

void PointTree::FindWithin(const Eigen::Vector3f& p, double radius_m, Found* found) const {
  found->items.clear();
  found->squared_m2.clear();
  if (!tree_) return;
  tree_->search.radiusSearch({p.x(), p.y(), p.z()}, radius_m, found->items, found->squared_m2);
}

}  // namespace slcmap::mapping
