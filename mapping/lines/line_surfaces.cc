#include "mapping/lines/line_surfaces.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr double kStep_m = 0.1;     // along a line
constexpr double kAround_m = 0.15;  // up to which points count
constexpr double kBeside_m = 0.02;  // from a line on, points are at one of its sides
constexpr int kMinPoints = 4;       // that show a surface at one side
constexpr double kTolerance_m = 0.015, kSigmas = 2;  // of points from a plane
constexpr double kMinOnPlane = 0.85;                 // of the points, where it is flat

// Where points are across a line, metres, and how far from a plane each may be.
struct Across {
  std::vector<Eigen::Vector2d> places;
  std::vector<double> tolerances_m;
};

// The direction, across the line, of the plane through it that the points are nearest to.
Eigen::Vector2d PlaneThroughLine(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& place : places) scatter += place * place.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvectors().col(1);
}

}  // namespace

struct LineSurfaces::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> index;
};

LineSurfaces::LineSurfaces(const std::vector<DensePoint>& cloud) : cloud_(cloud) {
  if (cloud.empty()) return;
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const DensePoint& point : cloud) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    points->push_back({p.x(), p.y(), p.z()});
  }
  tree_ = std::make_unique<Tree>();
  tree_->index.setInputCloud(points);
}

LineSurfaces::~LineSurfaces() = default;

LineSurfaces::Surface LineSurfaces::At(const Eigen::Vector3d& p_world,
                                       const Eigen::Vector3d& direction_world) const {
  if (!tree_) return Surface::kUnknown;
  const Eigen::Vector3f p = p_world.cast<float>();
  std::vector<int> found;
  std::vector<float> squared;
  tree_->index.radiusSearch({p.x(), p.y(), p.z()}, kAround_m, found, squared);
  const Eigen::Vector3d first = direction_world.unitOrthogonal();
  const Eigen::Vector3d second = direction_world.cross(first);
  Across across;
  for (const int i : found) {
    const Eigen::Vector3d offset = cloud_[i].p_world - p_world;
    across.places.emplace_back(first.dot(offset), second.dot(offset));
    across.tolerances_m.push_back(kTolerance_m + kSigmas * cloud_[i].sigma_m);
  }
  if (across.places.size() < 2 * kMinPoints) return Surface::kUnknown;
  const Eigen::Vector2d along = PlaneThroughLine(across.places);
  int left = 0, right = 0, on_plane = 0;
  for (size_t i = 0; i < across.places.size(); ++i) {
    const Eigen::Vector2d& place = across.places[i];
    const double beside_m = along.dot(place);
    const double off_m = std::abs(along.x() * place.y() - along.y() * place.x());
    if (off_m > across.tolerances_m[i]) continue;
    ++on_plane;
    left += beside_m < -kBeside_m;
    right += beside_m > kBeside_m;
  }
  const bool is_plane = on_plane >= kMinOnPlane * static_cast<double>(across.places.size());
  return is_plane && std::min(left, right) >= kMinPoints ? Surface::kFlat : Surface::kRelief;
}

SurfacesBeside LineSurfaces::Beside(const PointAndDirection& line,
                                    const std::vector<Stretch>& intervals) const {
  SurfacesBeside beside;
  for (const Stretch& interval : intervals) {
    const double length_m = interval.to_m - interval.from_m;
    const double count = std::max(1.0, std::round(length_m / kStep_m));
    for (double i = 0.5; i < count; ++i) {
      const double along_m = interval.from_m + i / count * length_m;
      const Surface surface =
          At(line.point_world + along_m * line.direction_world, line.direction_world);
      double& part_m = surface == Surface::kFlat     ? beside.flat_m
                       : surface == Surface::kRelief ? beside.relief_m
                                                     : beside.unknown_m;
      part_m += length_m / count;
    }
  }
  return beside;
}

}  // namespace slcmap
