#include "mapping/pipes/pipe_outlines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "mapping/map_poses.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// From its pieces, which are on one straight line.
Outline OutlineOf(const std::vector<const MapLine*>& pieces) {
  const MapLine& first = *pieces.front();
  Outline outline;
  outline.line_id = first.id;
  outline.segment = first.segment;
  outline.axis = first.axis;
  outline.world = first.world;
  outline.sigma_m = first.sigma_m;
  const Vector3d direction = (first.end_world - first.start_world).normalized();
  double from_m = 0, to_m = 0;
  for (const MapLine* piece : pieces) {
    for (const Vector3d& end : {piece->start_world, piece->end_world}) {
      const double along_m = direction.dot(end - first.start_world);
      from_m = std::min(from_m, along_m);
      to_m = std::max(to_m, along_m);
    }
  }
  outline.line = {first.start_world + 0.5 * (from_m + to_m) * direction, direction};
  outline.half_m = 0.5 * (to_m - from_m);
  for (const MapLine* piece : pieces) {
    const double start_m = direction.dot(piece->start_world - outline.line.point_world);
    const double end_m = direction.dot(piece->end_world - outline.line.point_world);
    outline.pieces.push_back({std::min(start_m, end_m), std::max(start_m, end_m)});
  }
  return outline;
}

TangentRay RayThrough(const Eigen::Vector2d& px, const Camera& camera,
                      const RigidTransform& T_world_camera, const Outline& outline,
                      const PipeOptions& options) {
  const Eigen::Vector2d on_plane = PlaneFromPixel(camera, px);
  TangentRay ray;
  ray.centre_world = T_world_camera.translation;
  ray.ray_world = T_world_camera.rotation * Vector3d(on_plane.x(), on_plane.y(), 1).normalized();
  // Where it is nearest to the line.
  const Vector3d across = ray.ray_world.cross(outline.line.direction_world);
  const Vector3d way = outline.line.point_world - ray.centre_world;
  const double sine2 = std::max(across.squaredNorm(), 1e-6);
  const double depth_m = way.cross(outline.line.direction_world).dot(across) / sine2;
  ray.sigma_m =
      std::hypot(options.sigma_px * std::abs(depth_m) / camera.fx_px, options.pose_sigma_m);
  return ray;
}

}  // namespace

std::vector<Outline> OutlinesOf(const MapResult& map, const PipeOptions& options) {
  std::map<int64_t, std::vector<const MapLine*>> pieces;
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) {
      if ((line.end_world - line.start_world).norm() > 0) pieces[line.id].push_back(&line);
    }
  }
  std::map<int64_t, Outline> outlines;
  for (const auto& [id, of_line] : pieces) outlines.emplace(id, OutlineOf(of_line));
  const auto poses = PosesByStamp(map);
  std::map<std::pair<int64_t, int>, int> images;
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto outline = outlines.find(support.line_id);
    const auto pose = poses.find(support.stamp_ns);
    if (outline == outlines.end() || pose == poses.end()) continue;
    const int next = static_cast<int>(images.size());
    const int image =
        images.emplace(std::pair(support.stamp_ns, support.camera), next).first->second;
    const RigidTransform T_world_camera =
        pose->second * map.rectified_rig.T_imu_camera[support.camera];
    for (const Eigen::Vector2d& px : {support.px.start, support.px.end}) {
      TangentRay ray = RayThrough(px, map.rectified_rig.cameras[support.camera], T_world_camera,
                                  outline->second, options);
      ray.image = image;
      outline->second.rays.push_back(ray);
    }
  }
  std::vector<Outline> seen;
  for (auto& [id, outline] : outlines) {
    if (!outline.rays.empty()) seen.push_back(std::move(outline));
  }
  return seen;
}

}  // namespace slcmap
