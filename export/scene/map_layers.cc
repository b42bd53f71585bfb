#include "export/scene/map_layers.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "data/core/polygon.h"
#include "export/scene/building_solids.h"
#include "export/scene/meshes.h"
#include "export/scene/plane_canvas.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector3d;

constexpr std::array<const char*, 5> kAxes = {"X", "Y", "VERTICAL", "OTHER", "SLOPED"};
constexpr std::array<const char*, 5> kLineKinds = {"LINE", "EDGE", "OUTLINE", "MARK", "PIPE"};
constexpr std::array<const char*, 4> kPlaneKinds = {"WALL", "FLOOR", "CEILING", "OTHER"};

// The storey, or -1 of a building without any.
int64_t FindStorey(const Building& building, const MapLine& line) {
  const std::optional<std::size_t> index = StoreyAtMiddle(building, line);
  return index ? building.storeys[*index].id : -1;
}

std::string LayerName(int64_t storey, LineAxis axis, LineKind kind) {
  return fmt::format("{}{}_{}", storey < 0 ? "" : StoreyPrefix(storey) + "_",
                     kAxes[static_cast<size_t>(axis)], kLineKinds[static_cast<size_t>(kind)]);
}

void AddPlane(const BuildingPlane& plane, const Building& building, PlanesOfLayer* layer) {
  if (plane.outline_world.size() < 3) return;
  const Vector3d x = plane.normal.unitOrthogonal();
  const Canvas canvas{plane.outline_world.front(), x, plane.normal.cross(x)};
  std::vector<PlanPoints> cuts;
  layer->outlines.push_back(plane.outline_world);
  const auto add_cut = [&](const std::vector<Vector3d>& outline_world) {
    cuts.push_back(PointsOn(canvas, outline_world));
    layer->outlines.push_back(outline_world);
  };
  for (const PlaneOpening& opening : plane.openings) add_cut(opening.outline_world);
  for (const auto& hole_world : LevelHoles(plane, building)) add_cut(hole_world);
  for (const Polygon& part :
       Difference({PointsOn(canvas, plane.outline_world), {}}, cuts, kOutlineGrid_m)) {
    for (const PlanTriangle& t : Triangulate(part)) {
      layer->triangles.push_back({canvas.At(t[0]), canvas.At(t[1]), canvas.At(t[2])});
    }
  }
}

}  // namespace

std::string WriteDeviation(const WallDeviation& wall) {
  if (wall.status != PlanStatus::kDeviates) return GetName(wall.status);
  return fmt::format("{:+.0f} \u00b1{:.0f}", 1e3 * wall.deviation_m,
                     std::max(1.0, 1e3 * wall.sigma_m));
}

std::string WriteDeviation(const OpeningDeviation& opening) {
  if (opening.status == PlanStatus::kMissing) return "closed";
  if (opening.status != PlanStatus::kDeviates) return GetName(opening.status);
  return fmt::format("{:+.0f}, width {:+.0f}", 1e3 * opening.moved_m, 1e3 * opening.wider_m);
}

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

std::vector<std::vector<Vector3d>> TrajectoryPieces(const Trajectory& trajectory) {
  const double gap_s = TrajectoryGap_s(trajectory);
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
