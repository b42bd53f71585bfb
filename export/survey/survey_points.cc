#include "export/survey/survey_points.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <string_view>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_layers.h"

namespace slcmap::inline exporting {
namespace {

const std::vector<DensePoint>& SurfacePoints(const MapResult& map, PointSource source) {
  return source == PointSource::kFilled ? map.filled : map.dense;
}

SurveyPoint FromMap(const MapResult& map, PointSource source, std::size_t index) {
  if (source == PointSource::kLandmark) {
    const MapPoint& point = map.points[index];
    return {.p = point.p_world, .sigma_m = point.sigma_m, .source = source};
  }
  const DensePoint& point = SurfacePoints(map, source)[index];
  return {point.p_world, point.normal_world, point.sigma_m, point.grey, source};
}

}  // namespace

const char* GetName(PointSource source) {
  return std::array{"", "stereo", "filled", "landmarks"}[static_cast<std::size_t>(source)];
}

std::size_t CountPoints(const MapResult& map, PointSource source) {
  return source == PointSource::kLandmark ? map.points.size() : SurfacePoints(map, source).size();
}

SurveyPoint PointAt(const MapResult& map, PointSource source, std::size_t index) {
  SurveyPoint point = FromMap(map, source, index);
  if (point.p.allFinite() && point.normal.allFinite()) return point;
  throw DataError(
      fmt::format("map: point {} of {}: found a number that is not finite, expected "
                  "metres: make the map again",
                  index, GetName(source)));
}

Georeference FindPlace(const MapSource& source) {
  return source.georeference.value_or(Georeference());
}

Eigen::Vector3d TurnedNormal(const Georeference& place, const Eigen::Vector3d& normal) {
  return Eigen::AngleAxisd(place.turn_rad, Eigen::Vector3d::UnitZ()) * normal;
}

namespace {

int ParseCode(std::string_view text) {
  int code = 0;
  const auto [stop, error] = std::from_chars(text.begin(), text.end(), code);
  return error == std::errc() && stop == text.end() && code > 0 ? code : 0;
}

}  // namespace

int EpsgCode(const std::string& crs) {
  constexpr std::string_view kAuthority = "EPSG:";
  if (!crs.starts_with(kAuthority)) return 0;
  return ParseCode(
      std::string_view(crs).substr(kAuthority.size(), crs.find('+') - kAuthority.size()));
}

int EpsgCodeOfHeights(const std::string& crs) {
  const size_t plus = crs.find('+');
  return EpsgCode(crs) == 0 || plus == crs.npos ? 0
                                                : ParseCode(std::string_view(crs).substr(plus + 1));
}

std::string CrsWkt(const Georeference& place, bool with_heights) {
  if (!place.crs.empty()) {
    const CoordinateSystem system(place.crs);
    return with_heights ? system.Wkt() : system.WktOfPlane();
  }
  return "LOCAL_CS[\"building, metres\",LOCAL_DATUM[\"building\",0],UNIT[\"metre\",1],"
         "AXIS[\"x\",EAST],AXIS[\"y\",NORTH]]";
}

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
  const WallHeight height = HeightOfWall(wall, building);
  return height.assumed ? std::nullopt : std::optional(height.height_m);
}

using Visitor = std::function<void(const StoreyFeature&)>;

void VisitWalls(const MapResult& map, const Georeference& place, const Visitor& visit) {
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
    visit(feature);
  }
}

void VisitRooms(const MapResult& map, const Georeference& place, const Visitor& visit) {
  for (const Room& room : map.building.rooms) {
    if (room.polygon.outline.size() < 3) continue;
    const double floor_m = (place * Vector3d(0, 0, room.floor_m)).z();
    visit({room.storey,
           {Placed(place, room.polygon)},
           {},
           {room.id, Known(room.name), room.area_m2, floor_m, Known(room.height_m), room.bounded}});
  }
}

void VisitOpenings(const MapResult& map, const Georeference& place, const Visitor& visit) {
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
      visit(feature);
    }
  }
}

void VisitLines(const MapResult& map, const Georeference& place, const Visitor& visit) {
  const auto add = [&](const auto& line, const char* kind, const Attribute& radius_m) {
    StoreyFeature feature;
    const auto storey = StoreyAtMiddle(map.building, line);
    if (storey) feature.storey = map.building.storeys[*storey].id;
    feature.line = {place * line.start_world, place * line.end_world};
    feature.attributes = {line.id, std::string(kind), std::string(AxisName(line.axis)),
                          line.sigma_m, radius_m};
    visit(feature);
  };
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) add(line, GetName(line.kind), Attribute());
  }
  for (const MapPipe& pipe : map.pipes) add(pipe, GetName(LineKind::kPipe), pipe.radius_m);
}

bool IsFinite(const StoreyFeature& feature) {
  for (const Vector3d& p : feature.line) {
    if (!p.allFinite()) return false;
  }
  for (const Polygon& area : feature.areas) {
    if (!std::isfinite(Area(area))) return false;
  }
  return true;
}

using VisitAll = void (*)(const MapResult& map, const Georeference& place, const Visitor& visit);

// How features of a layer are visited, with a look at their numbers.
std::function<void(const Visitor&)> Checked(const char* name, const MapResult& map,
                                            VisitAll visit_all) {
  return [name, &map, visit_all](const Visitor& visit) {
    visit_all(map, FindPlace(map.source), [&](const StoreyFeature& feature) {
      if (!IsFinite(feature)) {
        throw DataError(fmt::format(
            "map: {}: found a number that is not finite, expected metres: make the map again",
            name));
      }
      visit(feature);
    });
  };
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
  constexpr ColumnType kInteger = ColumnType::kInteger, kReal = ColumnType::kReal,
                       kText = ColumnType::kText, kBoolean = ColumnType::kBoolean;
  return {{"walls",
           "wall",
           FeatureGeometry::kAreas,
           {{"id", kInteger},
            {"thickness_m", kReal},
            {"thickness_assumed", kBoolean},
            {"height_m", kReal},
            {"sigma_m", kReal}},
           Checked("walls", map, VisitWalls)},
          {"rooms",
           "room",
           FeatureGeometry::kAreas,
           {{"id", kInteger},
            {"name", kText},
            {"area_m2", kReal},
            {"floor_m", kReal},
            {"height_m", kReal},
            {"bounded", kReal}},
           Checked("rooms", map, VisitRooms)},
          {"openings",
           "opening",
           FeatureGeometry::kLine,
           {{"wall", kInteger},
            {"name", kText},
            {"kind", kText},
            {"width_m", kReal},
            {"height_m", kReal},
            {"sill_m", kReal},
            {"walked", kBoolean}},
           Checked("openings", map, VisitOpenings)},
          {"lines",
           "line",
           FeatureGeometry::kLineInSpace,
           {{"id", kInteger},
            {"kind", kText},
            {"axis", kText},
            {"sigma_m", kReal},
            {"radius_m", kReal}},
           Checked("lines", map, VisitLines)}};
}

}  // namespace slcmap::exporting
