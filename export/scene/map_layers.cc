#include "export/scene/map_layers.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <tuple>

#include "data/core/polygon.h"
#include "export/scene/building_solids.h"
#include "export/scene/meshes.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array<const char*, 5> kAxes = {"X", "Y", "VERTICAL", "OTHER", "SLOPED"};
constexpr std::array<const char*, 5> kLineKinds = {"LINE", "EDGE", "OUTLINE", "MARK", "PIPE"};
constexpr std::array<const char*, 4> kPlaneKinds = {"WALL", "FLOOR", "CEILING", "OTHER"};

// The storey, or -1 of a building without any.
int64_t FindStorey(const Building& building, const MapLine& line) {
  const double height_m = 0.5 * (line.start_world.z() + line.end_world.z());
  const std::optional<std::size_t> index = StoreyAt(building, height_m);
  return index ? building.storeys[*index].id : -1;
}

std::string LayerName(int64_t storey, LineAxis axis, LineKind kind) {
  return fmt::format("{}{}_{}", storey < 0 ? "" : StoreyPrefix(storey) + "_",
                     kAxes[static_cast<size_t>(axis)], kLineKinds[static_cast<size_t>(kind)]);
}

// From a plane to its own coordinates and back.
class PlaneFrame {
 public:
  explicit PlaneFrame(const BuildingPlane& plane)
      : origin_(plane.outline_world.front()),
        u_(plane.normal.unitOrthogonal()),
        v_(plane.normal.cross(u_)) {}

  PlanPoints In(const std::vector<Vector3d>& points) const {
    PlanPoints flat;
    for (const Vector3d& p : points) flat.emplace_back(u_.dot(p - origin_), v_.dot(p - origin_));
    return flat;
  }

  Vector3d Out(const Vector2d& p) const { return origin_ + p.x() * u_ + p.y() * v_; }

 private:
  Vector3d origin_, u_, v_;
};

void AddPlane(const BuildingPlane& plane, const Building& building, PlanesOfLayer* layer) {
  if (plane.outline_world.size() < 3) return;
  const PlaneFrame frame(plane);
  std::vector<PlanPoints> cuts;
  layer->outlines.push_back(plane.outline_world);
  const auto add_cut = [&](const std::vector<Vector3d>& outline_world) {
    cuts.push_back(frame.In(outline_world));
    layer->outlines.push_back(outline_world);
  };
  for (const PlaneOpening& opening : plane.openings) add_cut(opening.outline_world);
  for (const auto& hole_world : LevelHoles(plane, building)) add_cut(hole_world);
  for (const Polygon& part :
       Difference({frame.In(plane.outline_world), {}}, cuts, kOutlineGrid_m)) {
    for (const PlanTriangle& t : Triangulate(part)) {
      layer->triangles.push_back({frame.Out(t[0]), frame.Out(t[1]), frame.Out(t[2])});
    }
  }
}

}  // namespace

std::string StoreyPrefix(int64_t storey) { return fmt::format("S{}", storey); }

std::vector<LinesOfLayer> LineLayers(const MapResult& map) {
  std::map<std::tuple<int64_t, LineAxis, LineKind>, LinesOfLayer> layers;
  const auto add = [&](const MapLine& line, LineKind kind) {
    const int64_t storey = FindStorey(map.building, line);
    LinesOfLayer& layer = layers[{storey, line.axis, kind}];
    if (layer.name.empty()) layer = {LayerName(storey, line.axis, kind), line.axis, {}};
    layer.lines.push_back({line.start_world, line.end_world});
  };
  for (const MapLine& line : map.lines) add(line, line.kind);
  for (const MapLine& mark : map.marks) add(mark, LineKind::kMark);
  for (const MapPipe& pipe : map.pipes) add(MakeAxisLine(pipe), LineKind::kPipe);
  std::vector<LinesOfLayer> sorted;
  for (auto& [key, layer] : layers) sorted.push_back(std::move(layer));
  return sorted;
}

std::vector<PlanesOfLayer> PlaneLayers(const Building& building) {
  std::map<std::pair<int64_t, PlaneKind>, PlanesOfLayer> layers;
  for (const BuildingPlane& plane : building.planes) {
    PlanesOfLayer& layer = layers[{plane.storey, plane.kind}];
    layer.name = fmt::format("{}_{}_PLANE", StoreyPrefix(plane.storey),
                             kPlaneKinds[static_cast<size_t>(plane.kind)]);
    layer.kind = plane.kind;
    AddPlane(plane, building, &layer);
  }
  std::vector<PlanesOfLayer> sorted;
  for (auto& [key, layer] : layers) sorted.push_back(std::move(layer));
  return sorted;
}

std::vector<std::vector<Vector3d>> TrajectoryPieces(const Trajectory& trajectory,
                                                    double max_jump_s) {
  const double gap_s = TrajectoryGap_s(trajectory, max_jump_s);
  std::vector<std::vector<Vector3d>> pieces;
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const bool is_new =
        i == 0 || ToSeconds(trajectory[i].stamp_ns - trajectory[i - 1].stamp_ns) > gap_s;
    if (is_new) pieces.emplace_back();
    pieces.back().push_back(trajectory[i].T_world_imu.translation);
  }
  std::erase_if(pieces, [](const auto& piece) { return piece.size() < 2; });
  return pieces;
}

}  // namespace slcmap::exporting
