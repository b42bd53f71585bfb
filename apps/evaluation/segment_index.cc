#include "apps/evaluation/segment_index.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "data/line_angle.h"

namespace slcmap {
namespace {

constexpr double kSpacing_m = 0.1;    // of the points that stand for a segment in the tree
constexpr double kRounding_m = 1e-3;  // beyond that of the tree's floats

double Distance(const PlySegment& segment, const Eigen::Vector3d& point) {
  const Eigen::Vector3d along = segment.end_world - segment.start_world;
  const double place = (point - segment.start_world).dot(along) / along.squaredNorm();
  return (segment.start_world + std::clamp(place, 0.0, 1.0) * along - point).norm();
}

double Angle(const PlySegment& segment, const Eigen::Vector3d& direction) {
  return LineAngle_rad(segment.end_world - segment.start_world, direction);
}

}  // namespace

// Points along the segments, none further than half the spacing from a place on its segment.
struct SegmentIndex::Tree {
  explicit Tree(const std::vector<PlySegment>& segments) {
    const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const Eigen::Vector3d along = segments[i].end_world - segments[i].start_world;
      const double count = std::max(std::ceil(along.norm() / kSpacing_m), 1.0);
      for (double k = 0.5; k < count; ++k) {
        const Eigen::Vector3f p = (segments[i].start_world + k / count * along).cast<float>();
        cloud->push_back({p.x(), p.y(), p.z()});
        segment_of.push_back(i);
      }
    }
    points.setInputCloud(cloud);
  }

  pcl::KdTreeFLANN<pcl::PointXYZ> points{false};  // results need no order
  std::vector<std::size_t> segment_of;            // by point
};

SegmentIndex::SegmentIndex(std::vector<PlySegment> segments) : segments_(std::move(segments)) {
  if (!segments_.empty()) tree_ = std::make_unique<Tree>(segments_);
}

SegmentIndex::~SegmentIndex() = default;

std::optional<SegmentIndex::Match> SegmentIndex::Nearest(const Eigen::Vector3d& point,
                                                         const Eigen::Vector3d& direction,
                                                         double max_distance_m,
                                                         double max_angle_rad) const {
  if (!tree_) return std::nullopt;
  pcl::Indices found;
  std::vector<float> squared_distances;
  const Eigen::Vector3f p = point.cast<float>();
  tree_->points.radiusSearch({p.x(), p.y(), p.z()}, max_distance_m + kSpacing_m / 2 + kRounding_m,
                             found, squared_distances);
  for (auto& index : found) index = static_cast<int>(tree_->segment_of[index]);
  // In the order of segments, so that the first of equally near ones is chosen.
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::optional<Match> best;
  for (const int index : found) {
    const PlySegment& segment = segments_[static_cast<std::size_t>(index)];
    const Match match{Distance(segment, point), Angle(segment, direction),
                      static_cast<std::size_t>(index)};
    if (match.distance_m > max_distance_m || match.angle_rad > max_angle_rad) continue;
    if (!best || match.distance_m < best->distance_m) best = match;
  }
  return best;
}

}  // namespace slcmap
