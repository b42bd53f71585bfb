#include "mapping/map/rays.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "mapping/map/map.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {

std::vector<RayBundle> KeyframeRays(const OdometryRun& run, const std::vector<MapPoint>& points) {
  std::unordered_map<int64_t, const MapPoint*> point_of_landmark;
  for (const MapPoint& point : points) {
    for (const int64_t id : point.landmark_ids) point_of_landmark[id] = &point;
  }
  std::vector<RayBundle> rays;
  for (const Keyframe& keyframe : run.keyframes) {
    for (const auto& [camera, is_pair] : CameraGroups(run.rectified_rig)) {
      RayBundle bundle;
      bundle.p_world_camera =
          (keyframe.T_world_imu * run.rectified_rig.T_imu_camera[camera]).translation;
      for (const KeyframeObservation& observation : keyframe.observations) {
        const auto point = point_of_landmark.find(observation.landmark_id);
        if (point == point_of_landmark.end() || observation.camera != camera) continue;
        bundle.p_world.push_back(point->second->p_world);
      }
      rays.push_back(std::move(bundle));
    }
  }
  return rays;
}

OccupancyMap MapOccupancy(const std::vector<RayBundle>& rays, const OccupancyOptions& options,
                          std::map<std::string, int64_t>* warnings, const Progress& progress) {
  OccupancyMap occupancy(options.resolution_m);
  const int64_t left_out = occupancy.Insert(rays, options.max_range_m, progress,
                                            static_cast<std::size_t>(options.max_voxels));
  if (left_out > 0) (*warnings)[kRayOutOfOctree] += left_out;
  return occupancy;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kApart_px = 30;  // of rays to one line
constexpr int kMostRays = 8;
constexpr double kLeastSigma_m = 0.03;
constexpr double kLeastSine = 0.1;  // between a ray and its line
constexpr double kNearest_m = 0.2;

using NumberedPieces = std::map<std::pair<int64_t, int>, const MapLine*>;  // by id and number

NumberedPieces NumberPieces(const MapResult& map) {
  NumberedPieces pieces;
  std::map<int64_t, int> next;
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) pieces.emplace(std::pair(line.id, next[line.id]++), &line);
  }
  return pieces;
}

// Where the ray of a pixel meets a line, on the part of it that is there.
std::optional<Vector3d> PlaceOn(const MapLine& line, const RigidTransform& T_world_camera,
                                const Camera& camera, const Vector2d& px) {
  const Vector3d way = line.end_world - line.start_world;
  const double length_m = way.norm();
  if (length_m <= 0) return std::nullopt;
  const Vector3d direction = way / length_m;
  const Vector3d ray =
      T_world_camera.rotation * PlaneFromPixel(camera, px).homogeneous().normalized();
  const Vector3d across = ray.cross(direction);
  const double sine2 = across.squaredNorm();
  if (sine2 < kLeastSine * kLeastSine) return std::nullopt;
  const Vector3d to_start = line.start_world - T_world_camera.translation;
  if (to_start.cross(direction).dot(across) / sine2 < kNearest_m) return std::nullopt;
  const double along_m = to_start.cross(ray).dot(across) / sine2;
  if (along_m < 0 || along_m > length_m) return std::nullopt;
  return Vector3d(line.start_world + along_m * direction);
}

void AddLineRays(const MapLine& line, const LineSegment& segment_px, const Camera& camera,
                 const RigidTransform& T_world_camera, ViewRays* rays) {
  const Vector2d way_px = segment_px.end - segment_px.start;
  const int count = std::clamp(static_cast<int>(way_px.norm() / kApart_px), 1, kMostRays);
  for (int i = 0; i < count; ++i) {
    const Vector2d px = segment_px.start + (i + 0.5) / count * way_px;
    const auto place = PlaceOn(line, T_world_camera, camera, px);
    if (!place) continue;
    rays->p_world.push_back(place->cast<float>());
    rays->sigma_m.push_back(static_cast<float>(std::max(line.sigma_m, kLeastSigma_m)));
  }
}

}  // namespace

std::vector<ViewRays> CollectLineRays(const MapResult& map) {
  const NumberedPieces pieces = NumberPieces(map);
  const auto poses = PosesByStamp(map);
  std::map<std::pair<int64_t, int>, ViewRays> images;  // by stamp and camera
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto line = pieces.find({support.line_id, support.piece});
    const auto pose = poses.find(support.stamp_ns);
    if (line == pieces.end() || pose == poses.end()) continue;
    const RigidTransform T_world_camera =
        pose->second * map.rectified_rig.T_imu_camera[support.camera];
    ViewRays& rays = images[{support.stamp_ns, support.camera}];
    rays.p_world_camera = T_world_camera.translation;
    AddLineRays(*line->second, support.px, map.rectified_rig.cameras[support.camera],
                T_world_camera, &rays);
  }
  std::vector<ViewRays> all;
  for (auto& [image, rays] : images) all.push_back(std::move(rays));
  return all;
}

}  // namespace slcmap::mapping
