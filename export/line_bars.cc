#include "export/line_bars.h"

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap {
namespace {

// The corners of a square about the origin, at right angles to a direction: counter-clockwise for
// who looks against it.
std::array<Eigen::Vector3d, 4> Section(const Eigen::Vector3d& direction, double width_m) {
  constexpr double kUpright = 0.99;
  const bool upright = std::abs(direction.z()) > kUpright;
  const Eigen::Vector3d reference = upright ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d side = reference.cross(direction).normalized() * (0.5 * width_m);
  const Eigen::Vector3d up = direction.cross(side);
  return {side - up, side + up, -side + up, -side - up};
}

void AddBar(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const Colour& start_colour,
            const Colour& end_colour, double width_m, MeshLayer* layer) {
  const auto s = static_cast<uint32_t>(layer->vertices.size());
  const uint32_t e = s + 4;  // the end's corners follow those of the start
  const std::array<Eigen::Vector3d, 4> section = Section((end - start).normalized(), width_m);
  for (const Eigen::Vector3d& corner : section) layer->vertices.Add(start + corner, start_colour);
  for (const Eigen::Vector3d& corner : section) layer->vertices.Add(end + corner, end_colour);
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t next = (i + 1) % 4;
    layer->triangles.push_back({s + i, s + next, e + next});
    layer->triangles.push_back({s + i, e + next, e + i});
  }
  layer->triangles.push_back({s + 3, s + 2, s + 1});
  layer->triangles.push_back({s + 3, s + 1, s});
  layer->triangles.push_back({e, e + 1, e + 2});
  layer->triangles.push_back({e, e + 2, e + 3});
}

}  // namespace

void AddBars(const LineLayer& lines, double width_m, MeshLayer* layer) {
  const auto& [positions, colours] = lines.vertices;
  for (const auto& [start, end] : lines.edges) {
    if (positions[start] == positions[end]) continue;
    AddBar(positions[start], positions[end], colours[start], colours[end], width_m, layer);
  }
}

}  // namespace slcmap
