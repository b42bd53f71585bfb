#include "mapping/planes/measured_around.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>

#include "data/quantile.h"

namespace slcmap {
namespace {

constexpr double kMinFacing = 0.7;  // cosine between normals

// In the axes of the plane, from its first corner: small numbers, which the tree holds as floats.
pcl::PointXYZ Along(const PlaneGrid& grid, const Eigen::Vector3d& p) {
  return {static_cast<float>(grid.u.dot(p) - grid.from_u_m),
          static_cast<float>(grid.v.dot(p) - grid.from_v_m), 0};
}

}  // namespace

struct MeasuredAround::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> places;
};

MeasuredAround::MeasuredAround(const PlaneGrid& grid, const std::vector<DensePoint>& cloud,
                               const PlaneOptions& options)
    : grid_(grid), cloud_(cloud), options_(options), tree_(std::make_unique<Tree>()) {
  const auto places = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (size_t i = 0; i < cloud.size(); ++i) {
    const DensePoint& point = cloud[i];
    if (point.source != DenseSource::kStereo ||
        std::abs(grid.DistanceTo(point.p_world)) > options.beside_m ||
        point.normal_world.dot(grid.normal) < kMinFacing) {
      continue;
    }
    beside_.push_back(i);
    places->push_back(Along(grid, point.p_world));
  }
  if (!places->empty()) tree_->places.setInputCloud(places);
}

MeasuredAround::~MeasuredAround() = default;

std::optional<SurfaceAround> MeasuredAround::At(double column, double row) const {
  if (std::ssize(beside_) < options_.neighbours) return std::nullopt;
  pcl::Indices found;
  std::vector<float> squares_m2;
  tree_->places.nearestKSearch(Along(grid_, grid_.At(column, row)), options_.neighbours, found,
                               squares_m2);
  std::vector<double> offsets_m;
  for (const auto i : found) {
    offsets_m.push_back(grid_.DistanceTo(cloud_[beside_[i]].p_world));
  }
  const double median_m = Quantile(offsets_m, 0.5);
  SurfaceAround around;
  int agreeing = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    if (std::abs(offsets_m[i] - median_m) > options_.agree_m) continue;
    around.offset_m += offsets_m[i];
    around.grey += cloud_[beside_[found[i]]].grey;
    ++agreeing;
  }
  if (agreeing < options_.min_share * options_.neighbours) return std::nullopt;
  const pcl::PointXYZ& nearest = (*tree_->places.getInputCloud())[found.front()];
  around.nearest = Eigen::Vector2d(nearest.x, nearest.y) / grid_.cell_m;
  around.nearest_m = std::sqrt(static_cast<double>(squares_m2.front()));
  around.offset_m /= agreeing;
  around.grey /= agreeing;
  return around;
}

}  // namespace slcmap
