#include "mapping/pipes/outlines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kOutlineSigma_px = 0.15;
constexpr double kLeastSine = 0.05;  // between ray and axis

// From its pieces, which are on one straight line.
Outline MakeOutline(const std::vector<const MapLine*>& pieces) {
  const MapLine& first = *pieces.front();
  Outline outline{first.id, first.segment, first.axis, first.world, {}, 0, {}, first.sigma_m, {}};
  const Vector3d direction = (first.end_world - first.start_world).normalized();
  Interval whole;
  for (const MapLine* piece : pieces) {
    const double a_m = direction.dot(piece->start_world - first.start_world);
    const double b_m = direction.dot(piece->end_world - first.start_world);
    outline.pieces.push_back({std::min(a_m, b_m), std::max(a_m, b_m)});
    whole = {std::min(whole.from_m, outline.pieces.back().from_m),
             std::max(whole.to_m, outline.pieces.back().to_m)};
  }
  const double middle_m = 0.5 * (whole.from_m + whole.to_m);
  for (Interval& piece : outline.pieces) piece = {piece.from_m - middle_m, piece.to_m - middle_m};
  outline.line = {first.start_world + middle_m * direction, direction};
  outline.half_m = 0.5 * whole.length_m();
  return outline;
}

OutlineSight MakeSight(const LineSegment& px, const Camera& camera,
                       const RigidTransform& T_world_camera, const Outline& outline) {
  const auto ray = [&](const Eigen::Vector2d& end_px) -> Vector3d {
    return T_world_camera.rotation * PlaneFromPixel(camera, end_px).homogeneous().normalized();
  };
  OutlineSight sight;
  sight.centre_world = T_world_camera.translation;
  sight.start_world = ray(px.start);
  sight.end_world = ray(px.end);
  const double distance_m =
      (NearestOn(outline.line, sight.centre_world) - sight.centre_world).norm();
  sight.pixel_m = distance_m / camera.fx_px;
  return sight;
}

}  // namespace

std::vector<Outline> CollectOutlines(const MapResult& map) {
  std::map<int64_t, std::vector<const MapLine*>> pieces;
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) {
      if (line.end_world != line.start_world) pieces[line.id].push_back(&line);
    }
  }
  std::map<int64_t, Outline> outlines;
  for (const auto& [id, of_line] : pieces) outlines.emplace(id, MakeOutline(of_line));
  const auto poses = PosesByStamp(map);
  std::map<std::pair<int64_t, int>, int> images;
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto outline = outlines.find(support.line_id);
    const auto pose = poses.find(support.stamp_ns);
    if (outline == outlines.end() || pose == poses.end()) continue;
    const RigidTransform T_world_camera =
        pose->second * map.rectified_rig.T_imu_camera[support.camera];
    OutlineSight sight = MakeSight(support.px, map.rectified_rig.cameras[support.camera],
                                   T_world_camera, outline->second);
    sight.image = images.emplace(std::pair(support.stamp_ns, support.camera), std::ssize(images))
                      .first->second;
    outline->second.sights.push_back(sight);
  }
  std::vector<Outline> seen;
  for (auto& [id, outline] : outlines) {
    if (!outline.sights.empty()) seen.push_back(std::move(outline));
  }
  return seen;
}

std::vector<TangentLine> FindTangents(const PointAndDirection& axis,
                                      const Eigen::Matrix<double, 3, 2>& across,
                                      const std::vector<const Outline*>& outlines) {
  std::vector<TangentLine> tangents;
  for (int i = 0; i < std::ssize(outlines); ++i) {
    for (const OutlineSight& sight : outlines[i]->sights) {
      const Vector3d start = sight.start_world.cross(axis.direction_world);
      const Vector3d end = sight.end_world.cross(axis.direction_world);
      if (std::min(start.norm(), end.norm()) < kLeastSine) continue;
      const Vector3d normal_world = (start.normalized() + end.normalized()).normalized();
      const Vector3d way = sight.centre_world - axis.point_world;
      TangentLine tangent;
      tangent.normal = across.transpose() * normal_world;
      tangent.offset_m = normal_world.dot(way);
      tangent.side = tangent.offset_m < 0 ? -1 : 1;
      tangent.sigma_m = kOutlineSigma_px * sight.pixel_m;
      tangent.image = sight.image;
      tangent.outline = i;
      tangent.to_camera = (across.transpose() * way).normalized();
      tangents.push_back(tangent);
    }
  }
  std::ranges::stable_sort(tangents, {}, &TangentLine::image);
  return tangents;
}

}  // namespace slcmap::mapping
