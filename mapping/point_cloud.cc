#include "mapping/point_cloud.h"

#include <pcl/filters/statistical_outlier_removal.h>
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
                 return landmark.p_world.allFinite() && landmark.sigma_m <= options.max_sigma_m &&
                        landmark.observations >= options.min_observations;
               });
  return selected;
}

std::vector<MapPoint> FuseLandmarks(const std::vector<Landmark>& landmarks,
                                    const CloudOptions& options) {
  std::map<std::pair<int, VoxelIndex>, std::vector<const Landmark*>> voxels;
  for (const Landmark& landmark : landmarks) {
    voxels[{landmark.segment, VoxelOf(landmark.p_world, options.voxel_m)}].push_back(&landmark);
  }
  std::vector<MapPoint> points;
  for (const auto& [index, members] : voxels) points.push_back(Fuse(members));
  return points;
}

std::vector<MapPoint> RemoveOutliers(std::vector<MapPoint> points, const CloudOptions& options) {
  // PCL reads beyond its arrays when there are fewer points than neighbours to look at.
  if (points.size() <= static_cast<std::size_t>(options.outlier_neighbours)) return points;
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const MapPoint& point : points) {
    const Eigen::Vector3f p = point.p_world.cast<float>();
    cloud->emplace_back(p.x(), p.y(), p.z());
  }
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setMeanK(options.outlier_neighbours);
  filter.setStddevMulThresh(options.outlier_sigmas);
  pcl::Indices kept;
  filter.filter(kept);
  std::vector<MapPoint> inliers;
  for (const pcl::index_t index : kept) {
    inliers.push_back(std::move(points[static_cast<std::size_t>(index)]));
  }
  return inliers;
}

// Written without PCL's own writer, which refuses clouds without points and brings in all of VTK.
void WritePcd(const std::string& path, const std::vector<MapPoint>& points) {
  std::string bytes = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS x y z sigma_m observations\nSIZE 4 4 4 4 4\nTYPE F F F F I\nCOUNT 1 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  for (const MapPoint& point : points) {
    for (const double value : point.p_world) Append(static_cast<float>(value), &bytes);
    Append(static_cast<float>(point.sigma_m), &bytes);
    Append(static_cast<int32_t>(point.observations), &bytes);
  }
  WriteFile(path, bytes);
}

}  // namespace slcmap
