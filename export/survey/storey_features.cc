#include "export/survey/storey_features.h"

#include <spdlog/fmt/fmt.h>

#include "data/core/error.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_layers.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Attribute Known(const std::optional<double>& value) {
  return value ? Attribute(*value) : Attribute();
}

Attribute Known(const std::string& name) { return name.empty() ? Attribute() : Attribute(name); }

PlanPoints Placed(const Georeference& place, const PlanPoints& ring) {
  PlanPoints placed;
  for (const Vector2d& p : ring) placed.push_back((place * Vector3d(p.x(), p.y(), 0)).head<2>());
  return placed;
}

Polygon Placed(const Georeference& place, const Polygon& area) {
  Polygon placed = {Placed(place, area.outline), {}};
  for (const PlanPoints& hole : area.holes) placed.holes.push_back(Placed(place, hole));
  return placed;
}

// Assumed heights of walls are no attribute: those are not known.
std::optional<double> KnownHeight(const PlanWall& wall, const Building& building) {
  const WallHeight height = HeightOfWall(wall, building, 0);
  return height.assumed ? std::nullopt : std::optional(height.height_m);
}

FeatureLayer Walls(const MapResult& map, const Georeference& place) {
  FeatureLayer layer = {"walls",
                        "wall",
                        FeatureGeometry::kAreas,
                        {{"id", ColumnType::kInteger},
                         {"thickness_m", ColumnType::kReal},
                         {"thickness_assumed", ColumnType::kBoolean},
                         {"height_m", ColumnType::kReal},
                         {"sigma_m", ColumnType::kReal}},
                        {}};
  const std::map<const PlanWall*, WallSolid> solids = SolidsOfWalls(map.building);
  for (const PlanWall& wall : map.building.walls) {
    const auto solid = solids.find(&wall);
    if (solid == solids.end()) continue;
    StoreyFeature feature;
    feature.storey = wall.storey;
    for (const auto& [from_m, to_m] : Intervals(solid->second)) {
      feature.areas.push_back(Placed(place, MakePiece(solid->second, from_m, to_m)));
    }
    if (feature.areas.empty()) continue;  // it is all openings
    feature.attributes = {wall.id, wall.thickness_m, wall.thickness_assumed,
                          Known(KnownHeight(wall, map.building)), wall.sigma_m};
    layer.features.push_back(feature);
  }
  return layer;
}

FeatureLayer Rooms(const MapResult& map, const Georeference& place) {
  FeatureLayer layer = {"rooms",
                        "room",
                        FeatureGeometry::kAreas,
                        {{"id", ColumnType::kInteger},
                         {"name", ColumnType::kText},
                         {"area_m2", ColumnType::kReal},
                         {"floor_m", ColumnType::kReal},
                         {"height_m", ColumnType::kReal},
                         {"bounded", ColumnType::kReal}},
                        {}};
  for (const Room& room : map.building.rooms) {
    if (room.polygon.outline.size() < 3) continue;
    const double floor_m = (place * Vector3d(0, 0, room.floor_m)).z();
    layer.features.push_back(
        {room.storey,
         {Placed(place, room.polygon)},
         {},
         {room.id, Known(room.name), room.area_m2, floor_m, Known(room.height_m), room.bounded}});
  }
  return layer;
}

FeatureLayer Openings(const MapResult& map, const Georeference& place) {
  FeatureLayer layer = {"openings",
                        "opening",
                        FeatureGeometry::kLine,
                        {{"wall", ColumnType::kInteger},
                         {"name", ColumnType::kText},
                         {"kind", ColumnType::kText},
                         {"width_m", ColumnType::kReal},
                         {"height_m", ColumnType::kReal},
                         {"sill_m", ColumnType::kReal},
                         {"walked", ColumnType::kBoolean}},
                        {}};
  for (const auto& [wall, solid] : SolidsOfWalls(map.building)) {
    const double behind_m = 0.5 * solid.Thickness();
    for (const PlanOpening& opening : wall->openings) {
      StoreyFeature feature;
      feature.storey = wall->storey;
      for (const double along_m : {opening.from_m, opening.to_m}) {
        const Vector2d p = solid.At(along_m, behind_m);
        feature.line.push_back(place * Vector3d(p.x(), p.y(), 0));
      }
      feature.attributes = {wall->id,
                            Known(opening.name),
                            std::string(GetName(opening.kind)),
                            opening.to_m - opening.from_m,
                            opening.clear_height_m,
                            opening.sill_m,
                            opening.walked};
      layer.features.push_back(feature);
    }
  }
  return layer;
}

FeatureLayer Lines(const MapResult& map, const Georeference& place) {
  FeatureLayer layer = {"lines",
                        "line",
                        FeatureGeometry::kLineInSpace,
                        {{"id", ColumnType::kInteger},
                         {"kind", ColumnType::kText},
                         {"axis", ColumnType::kText},
                         {"sigma_m", ColumnType::kReal},
                         {"radius_m", ColumnType::kReal}},
                        {}};
  const auto add = [&](const auto& line, const char* kind, const Attribute& radius_m) {
    StoreyFeature feature;
    const auto storey = StoreyAt(map.building, 0.5 * (line.start_world.z() + line.end_world.z()));
    if (storey) feature.storey = map.building.storeys[*storey].id;
    feature.line = {place * line.start_world, place * line.end_world};
    feature.attributes = {line.id, std::string(kind), std::string(AxisName(line.axis)),
                          line.sigma_m, radius_m};
    layer.features.push_back(feature);
  };
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) add(line, GetName(line.kind), Attribute());
  }
  for (const MapPipe& pipe : map.pipes) add(pipe, GetName(LineKind::kPipe), pipe.radius_m);
  return layer;
}

void RequireFinite(const FeatureLayer& layer, const StoreyFeature& feature) {
  bool is_finite = true;
  for (const Vector3d& p : feature.line) is_finite = is_finite && p.allFinite();
  for (const Polygon& area : feature.areas) {
    for (const Vector2d& p : area.outline) is_finite = is_finite && p.allFinite();
    for (const PlanPoints& hole : area.holes) {
      for (const Vector2d& p : hole) is_finite = is_finite && p.allFinite();
    }
  }
  if (is_finite) return;
  throw DataError(
      fmt::format("map: {}: found a number that is not finite, expected metres: make "
                  "the map again",
                  layer.name));
}

}  // namespace

Eigen::AlignedBox2d ComputeExtent(const StoreyFeature& feature) {
  Eigen::AlignedBox2d extent;
  for (const Vector3d& p : feature.line) extent.extend(Vector2d(p.head<2>()));
  for (const Polygon& area : feature.areas) {
    for (const Vector2d& p : area.outline) extent.extend(p);
  }
  return extent;
}

std::vector<FeatureLayer> MakeFeatureLayers(const MapResult& map) {
  const Georeference place = FindPlace(map.source);
  std::vector<FeatureLayer> layers = {Walls(map, place), Rooms(map, place), Openings(map, place),
                                      Lines(map, place)};
  for (const FeatureLayer& layer : layers) {
    for (const StoreyFeature& feature : layer.features) RequireFinite(layer, feature);
  }
  return layers;
}

}  // namespace slcmap::exporting
