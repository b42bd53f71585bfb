#include "apps/evaluation/cloud_metrics.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "apps/evaluation/no_figure.h"
#include "data/ply.h"

namespace slcmap {
namespace {

double ShareWithin(const std::vector<double>& distances_m, double tolerance_m) {
  const auto is_within = [&](double distance_m) { return distance_m <= tolerance_m; };
  return ComputeShare(std::count_if(distances_m.begin(), distances_m.end(), is_within),
                 std::ssize(distances_m));
}

std::vector<double> DistancesToSurfaces(const TriangleTree& surfaces, const EvaluatedCloud& cloud,
                                        double max_m) {
  std::vector<double> distances_m;
  for (const Eigen::Vector3d& p : cloud.points) {
    distances_m.push_back(surfaces.Distance_m(p, max_m));
  }
  return distances_m;
}

// Of values of the points of a cloud.
template <typename Value>
std::vector<Value> OfFilled(const std::vector<Value>& values, const EvaluatedCloud& cloud) {
  std::vector<Value> filled;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (cloud.sources[i] == 1) filled.push_back(values[i]);
  }
  return filled;
}

// Of points to the nearest of others.
std::vector<double> Distances(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<Eigen::Vector3d>& others) {
  if (others.empty()) return std::vector<double>(points.size(), HUGE_VAL);
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3d& p : others) {
    cloud->push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<double> distances_m;
  pcl::Indices found;
  std::vector<float> squared_m2;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3f p = point.cast<float>();
    tree.nearestKSearch({p.x(), p.y(), p.z()}, 1, found, squared_m2);
    distances_m.push_back(std::sqrt(static_cast<double>(squared_m2.front())));
  }
  return distances_m;
}

std::vector<Eigen::Vector3d> PlacesOf(const std::vector<SeenSample>& samples) {
  std::vector<Eigen::Vector3d> places;
  for (const SeenSample& sample : samples) places.push_back(sample.p);
  return places;
}

double RmsBelow(const std::vector<double>& distances_m, double limit_m) {
  double sum = 0;
  int64_t count = 0;
  for (const double distance_m : distances_m) {
    if (distance_m >= limit_m) continue;
    sum += distance_m * distance_m;
    ++count;
  }
  return std::sqrt(ComputeShare(sum, static_cast<double>(count)));
}

// Of shares; 0 where one of them is, whatever the other.
double HarmonicMean(double a, double b) { return a == 0 || b == 0 ? 0 : 2 * a * b / (a + b); }

}  // namespace

EvaluatedCloud ReadEvaluatedCloud(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  EvaluatedCloud cloud{Positions(vertices, path), std::vector<int>(vertices.size(), 0)};
  for (const PlyProperty& property : vertices.properties) {
    if (property.name != "source") continue;
    for (std::size_t i = 0; i < cloud.sources.size(); ++i) {
      cloud.sources[i] = static_cast<int>(property.values[i]);
    }
  }
  return cloud;
}

EvaluatedCloud Aligned(const Alignment& alignment, EvaluatedCloud cloud) {
  for (Eigen::Vector3d& p : cloud.points) p = alignment.Position(p);
  return cloud;
}

CloudMetrics EvaluateCloud(const TriangleTree& surfaces, const std::vector<SeenSample>& seen,
                           const EvaluatedCloud& cloud, const CloudMetricOptions& options) {
  const double largest_m = options.tolerances_m.back();
  const std::vector<double> to_surfaces_m =
      DistancesToSurfaces(surfaces, cloud, std::nextafter(largest_m, HUGE_VAL));
  const std::vector<double> filled_m = OfFilled(to_surfaces_m, cloud);
  const std::vector<Eigen::Vector3d> samples = PlacesOf(seen);
  const std::vector<double> to_cloud_m = Distances(samples, cloud.points);
  std::vector<std::vector<double>> to_cloud_of_range_m;
  CloudMetrics metrics;
  for (const double range_m : options.ranges_m) {
    to_cloud_of_range_m.emplace_back();
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].range_m <= range_m) to_cloud_of_range_m.back().push_back(to_cloud_m[i]);
    }
    metrics.seen_samples.push_back(static_cast<int64_t>(to_cloud_of_range_m.back().size()));
  }
  metrics.points = static_cast<int64_t>(cloud.points.size());
  metrics.filled = static_cast<int64_t>(filled_m.size());
  metrics.filled_seen =
      ShareWithin(Distances(OfFilled(cloud.points, cloud), samples), options.nearby_m);
  metrics.rms_m = RmsBelow(to_surfaces_m, largest_m);
  for (const double tolerance_m : options.tolerances_m) {
    CloudScore score;
    score.tolerance_m = tolerance_m;
    score.accuracy = ShareWithin(to_surfaces_m, tolerance_m);
    score.filled_accuracy = ShareWithin(filled_m, tolerance_m);
    for (const std::vector<double>& distances_m : to_cloud_of_range_m) {
      score.completeness.push_back(ShareWithin(distances_m, tolerance_m));
      score.f.push_back(HarmonicMean(score.accuracy, score.completeness.back()));
    }
    metrics.scores.push_back(std::move(score));
  }
  return metrics;
}

}  // namespace slcmap
