#include "mapping/line_sights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "mapping/map_poses.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kApart_px = 30;  // of rays to one line
constexpr int kMostRays = 8;
constexpr double kLeastSigma_m = 0.03;
constexpr double kLeastSine = 0.1;  // between a ray and its line
constexpr double kNearest_m = 0.2;

using NumberedPieces = std::map<std::pair<int64_t, int>, const MapLine*>;  // by id and number

NumberedPieces NumberedPiecesOf(const MapResult& map) {
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

void AddSights(const MapLine& line, const LineSegment& segment_px, const Camera& camera,
               const RigidTransform& T_world_camera, Sights* sights) {
  const Vector2d way_px = segment_px.end - segment_px.start;
  const int count = std::clamp(static_cast<int>(way_px.norm() / kApart_px), 1, kMostRays);
  for (int i = 0; i < count; ++i) {
    const Vector2d px = segment_px.start + (i + 0.5) / count * way_px;
    const auto place = PlaceOn(line, T_world_camera, camera, px);
    if (!place) continue;
    sights->p_world.push_back(place->cast<float>());
    sights->sigma_m.push_back(static_cast<float>(std::max(line.sigma_m, kLeastSigma_m)));
  }
}

}  // namespace

std::vector<Sights> SightsOfLines(const MapResult& map) {
  const NumberedPieces pieces = NumberedPiecesOf(map);
  const auto poses = PosesByStamp(map);
  std::map<std::pair<int64_t, int>, Sights> images;  // by stamp and camera
  for (const LineSupport& support : map.line_evidence.supports) {
    const auto line = pieces.find({support.line_id, support.piece});
    const auto pose = poses.find(support.stamp_ns);
    if (line == pieces.end() || pose == poses.end()) continue;
    const RigidTransform T_world_camera =
        pose->second * map.rectified_rig.T_imu_camera[support.camera];
    Sights& sights = images[{support.stamp_ns, support.camera}];
    sights.p_world_camera = T_world_camera.translation;
    AddSights(*line->second, support.px, map.rectified_rig.cameras[support.camera], T_world_camera,
              &sights);
  }
  std::vector<Sights> all;
  for (auto& [image, sights] : images) all.push_back(std::move(sights));
  return all;
}

}  // namespace slcmap
