#include "export/pipe_tubes.h"

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap {
namespace {

constexpr uint32_t kSides = 24;

// Counter-clockwise for who looks against the direction.
std::vector<Eigen::Vector3d> Rim(const Eigen::Vector3d& direction, double radius_m) {
  const Eigen::Vector3d first = direction.unitOrthogonal(), second = direction.cross(first);
  std::vector<Eigen::Vector3d> rim;
  for (uint32_t i = 0; i < kSides; ++i) {
    const double angle_rad = 2 * M_PI * i / kSides;
    rim.emplace_back(radius_m * (std::cos(angle_rad) * first + std::sin(angle_rad) * second));
  }
  return rim;
}

}  // namespace

MapLine MakeAxisLine(const MapPipe& pipe) {
  MapLine line;
  line.id = pipe.id;
  line.segment = pipe.segment;
  line.axis = pipe.axis;
  line.world = pipe.world;
  line.sigma_m = pipe.sigma_m;
  line.start_world = pipe.start_world;
  line.end_world = pipe.end_world;
  line.observations = pipe.images;
  line.kind = LineKind::kPipe;
  return line;
}

void AddTube(const MapPipe& pipe, const Colour& colour, MeshLayer* layer) {
  const Eigen::Vector3d way = pipe.end_world - pipe.start_world;
  if (!(way.norm() > 0)) return;
  const auto s = static_cast<uint32_t>(layer->vertices.size());
  const uint32_t e = s + kSides, start = e + kSides, end = start + 1;
  const std::vector<Eigen::Vector3d> rim = Rim(way.normalized(), pipe.radius_m);
  for (const Eigen::Vector3d& p : rim) layer->vertices.Add(pipe.start_world + p, colour);
  for (const Eigen::Vector3d& p : rim) layer->vertices.Add(pipe.end_world + p, colour);
  layer->vertices.Add(pipe.start_world, colour);
  layer->vertices.Add(pipe.end_world, colour);
  for (uint32_t i = 0; i < kSides; ++i) {
    const uint32_t next = (i + 1) % kSides;
    layer->triangles.push_back({s + i, s + next, e + next});
    layer->triangles.push_back({s + i, e + next, e + i});
    layer->triangles.push_back({start, s + next, s + i});
    layer->triangles.push_back({end, e + i, e + next});
  }
}

}  // namespace slcmap
