#include "mapping/point_cloud.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "data/file.h"

namespace slcmap {
namespace {

// Landmarks seen from far apart can be more certain than their model deserves.
constexpr double kMinSigma_m = 1e-3;
constexpr double kMaxDistance_m = 1e7;  // of a landmark from the origin; the Earth's radius is less
constexpr std::size_t kReportEvery = 1024;

using VoxelIndex = std::array<int64_t, 3>;

VoxelIndex VoxelOf(const Eigen::Vector3d& p_world, double voxel_m) {
  const auto index = [&](double coordinate) {
    return static_cast<int64_t>(std::floor(coordinate / voxel_m));
  };
  return {index(p_world.x()), index(p_world.y()), index(p_world.z())};
}

MapPoint Fuse(const std::vector<const Landmark*>& landmarks) {
  MapPoint point;
  double weight_sum = 0;
  for (const Landmark* landmark : landmarks) {
    const double sigma_m = std::max(landmark->sigma_m, kMinSigma_m);
    const double weight = 1 / (sigma_m * sigma_m);
    point.p_world += weight * landmark->p_world;
    point.observations += landmark->observations;
    point.landmark_ids.push_back(landmark->id);
    weight_sum += weight;
  }
  point.p_world /= weight_sum;
  point.sigma_m = 1 / std::sqrt(weight_sum);
  return point;
}

double Share(std::size_t done, std::size_t all) {
  return static_cast<double>(done) / static_cast<double>(all);
}

// The mean distance of each point to its `count` nearest neighbours; of the first ones only, once
// progress says so. Not PCL's own filter, which cannot be ended early.
std::vector<float> NeighbourDistances(const std::vector<MapPoint>& points, int count,
                                      const Progress& progress) {
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const MapPoint& point : points) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    cloud->push_back({p.x(), p.y(), p.z()});
  }
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<float> distances_m;
  pcl::Indices found;
  std::vector<float> squared_m2;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % kReportEvery == 0 && !progress.Report(Share(i, points.size()))) break;
    tree.nearestKSearch((*cloud)[i], count + 1, found, squared_m2);  // the first is itself
    double sum_m = 0;
    for (std::size_t k = 1; k < squared_m2.size(); ++k) sum_m += std::sqrt(squared_m2[k]);
    distances_m.push_back(static_cast<float>(sum_m / count));
  }
  return distances_m;
}

// `sigmas` standard deviations above the mean.
double OutlierLimit(const std::vector<float>& distances_m, double sigmas) {
  double sum = 0, squared_sum = 0;
  for (const double distance_m : distances_m) {
    sum += distance_m;
    squared_sum += distance_m * distance_m;
  }
  const double count = static_cast<double>(distances_m.size());
  const double variance = (squared_sum - sum * sum / count) / (count - 1);
  return sum / count + sigmas * std::sqrt(std::max(variance, 0.0));
}

template <typename T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::vector<Landmark> SelectLandmarks(const std::vector<Landmark>& landmarks,
                                      const CloudOptions& options) {
  std::vector<Landmark> selected;
  std::copy_if(landmarks.begin(), landmarks.end(), std::back_inserter(selected),
               [&](const Landmark& landmark) {
                 return landmark.p_world.norm() <= kMaxDistance_m &&
                        landmark.sigma_m <= options.max_sigma_m &&
                        landmark.observations >= options.min_observations;
               });
  return selected;
}

std::vector<MapPoint> FuseLandmarks(const std::vector<Landmark>& landmarks,
                                    const CloudOptions& options, const Progress& progress) {
  std::map<std::pair<int, VoxelIndex>, std::vector<const Landmark*>> voxels;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (i % kReportEvery == 0 && !progress.Report(Share(i, landmarks.size()))) break;
    const Landmark& landmark = landmarks[i];
    voxels[{landmark.segment, VoxelOf(landmark.p_world, options.voxel_m)}].push_back(&landmark);
  }
  std::vector<MapPoint> points;
  for (const auto& [index, members] : voxels) points.push_back(Fuse(members));
  return points;
}

std::vector<MapPoint> RemoveOutliers(std::vector<MapPoint> points, const CloudOptions& options,
                                     const Progress& progress) {
  if (points.size() <= static_cast<std::size_t>(options.outlier_neighbours)) return points;
  const std::vector<float> distances_m =
      NeighbourDistances(points, options.outlier_neighbours, progress);
  if (distances_m.size() < points.size()) return points;
  const double limit_m = OutlierLimit(distances_m, options.outlier_sigmas);
  std::vector<MapPoint> inliers;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (distances_m[i] <= limit_m) inliers.push_back(std::move(points[i]));
  }
  return inliers;
}

// Written without PCL's own writer, which refuses clouds without points and brings in all of VTK.
void WritePcd(const std::string& path, const std::vector<MapPoint>& points) {
  std::string bytes = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS x y z sigma_m observations line_id\nSIZE 4 4 4 4 4 4\nTYPE F F F F I I\n"
      "COUNT 1 1 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  for (const MapPoint& point : points) {
    for (const double value : point.p_world) Append(static_cast<float>(value), &bytes);
    Append(static_cast<float>(point.sigma_m), &bytes);
    Append(static_cast<int32_t>(point.observations), &bytes);
    Append(static_cast<int32_t>(point.line_id), &bytes);
  }
  WriteFile(path, bytes);
}

}  // namespace slcmap
