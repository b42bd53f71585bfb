// GeoJSON: a file a storey.
#include <spdlog/fmt/fmt.h>

#include <optional>

#include "data/core/coordinate_system.h"
#include "data/io/json.h"
#include "export/scene/building_solids.h"
#include "export/scene/formats.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {
namespace {

// Geometries in degrees of WGS 84, as RFC 7946 wants them, where a map's place on Earth is known,
// else in metres of its own frame.
class GeoJsonGeometry {
 public:
  explicit GeoJsonGeometry(const Georeference& place) {
    if (!place.crs.empty()) system_.emplace(place.crs);
  }

  bool InDegrees() const { return system_.has_value(); }

  Json Make(const FeatureLayer& layer, const StoreyFeature& feature) const {
    if (layer.geometry == FeatureGeometry::kAreas) return Areas(feature.areas);
    Json points = Json::array();
    for (const Eigen::Vector3d& p : feature.line) {
      points.push_back(Position(p.head<2>()));
      const bool in_space = layer.geometry == FeatureGeometry::kLineInSpace;
      if (in_space) points.back().push_back(RoundedForJson(p.z()));
    }
    return {{"type", "LineString"}, {"coordinates", points}};
  }

 private:
  // Degrees to a tenth of a millimetre.
  Json Position(const Eigen::Vector2d& p) const {
    constexpr double kDegreeParts = 1e9;
    if (!system_) return PointJson(p);
    const auto degrees = system_->LongitudeLatitude_deg(p);
    if (!degrees) {
      throw DataError(fmt::format(
          "geojson: found a point at {:.2f} {:.2f} m that {} does not reach, expected the map's "
          "control points in that system",
          p.x(), p.y(), system_->name()));
    }
    const Eigen::Array2d rounded = (kDegreeParts * degrees->array()).round() / kDegreeParts;
    return Json::array({rounded.x(), rounded.y()});
  }

  Json Closed(const PlanPoints& ring) const {
    Json points = Json::array();
    for (const Eigen::Vector2d& p : ring) points.push_back(Position(p));
    points.push_back(points.front());
    return points;
  }

  Json Areas(const std::vector<Polygon>& areas) const {
    Json polygons = Json::array();
    for (const Polygon& area : areas) {
      Json rings = Json::array({Closed(area.outline)});
      for (const PlanPoints& hole : area.holes) rings.push_back(Closed(hole));
      polygons.push_back(rings);
    }
    if (polygons.size() == 1) return {{"type", "Polygon"}, {"coordinates", polygons.front()}};
    return {{"type", "MultiPolygon"}, {"coordinates", polygons}};
  }

  std::optional<CoordinateSystem> system_;
};

// In one line; names may hold any bytes, JSON holds UTF-8.
std::string DumpInOneLine(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json AttributeJson(const Attribute& attribute) {
  return std::visit(
      [](const auto& value) -> Json {
        using Value = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, std::monostate>) {
          return nullptr;
        } else if constexpr (std::is_same_v<Value, double>) {
          return RoundedForJson(value);
        } else {
          return value;
        }
      },
      attribute);
}

Json FeatureJson(const FeatureLayer& layer, const StoreyFeature& feature,
                 const GeoJsonGeometry& geometry) {
  Json properties = {{"feature", layer.feature}};
  for (std::size_t i = 0; i < layer.columns.size(); ++i) {
    properties[layer.columns[i].name] = AttributeJson(feature.attributes[i]);
  }
  return {
      {"type", "Feature"}, {"properties", properties}, {"geometry", geometry.Make(layer, feature)}};
}

// All but the features.
Json PlanJson(const MapResult& map, const std::optional<int64_t>& storey, bool in_degrees) {
  Json plan = {{"map", map.id}, {"units", in_degrees ? "degrees" : "metres"}};
  if (storey) plan["storey"] = *storey;
  if (const auto index = StoreyOfId(map.building, storey.value_or(-1))) {
    plan["name"] = GetTitle(map.building.storeys[*index]);
  }
  Json json = {{"type", "FeatureCollection"}, {"slcmap", plan}};
  // The RFC knows degrees alone: metres are told as its forerunner of 2008 told a system.
  if (!in_degrees) {
    json["crs"] = {{"type", "name"}, {"properties", {{"name", CrsWkt(FindPlace(map.source))}}}};
  }
  return json;
}

// A line a feature: there may be a million of them.
void WriteStorey(const std::string& path, const MapResult& map,
                 const std::optional<int64_t>& storey) {
  const GeoJsonGeometry geometry(FindPlace(map.source));
  std::string head = DumpInOneLine(PlanJson(map, storey, geometry.InDegrees()));
  head.pop_back();  // the brace: the features are the last that is in it
  FileWriter file(path);
  file.Add(head + ",\"features\":[");
  bool is_first = true;
  for (const FeatureLayer& layer : MakeFeatureLayers(map)) {
    layer.visit([&](const StoreyFeature& feature) {
      if (feature.storey != storey) return;
      file.Add((is_first ? "\n" : ",\n") + DumpInOneLine(FeatureJson(layer, feature, geometry)));
      is_first = false;
    });
  }
  file.Add("\n]}\n");
  file.Close();
}

}  // namespace

std::vector<std::string> WriteGeoJson(const std::string& folder, const MapResult& map,
                                      const Progress&) {
  MakeFolder(folder + "/plan");
  std::vector<std::string> paths;
  const auto write = [&](const std::string& name, const std::optional<int64_t>& storey) {
    paths.push_back(fmt::format("{}/plan/{}.geojson", folder, name));
    WriteStorey(paths.back(), map, storey);
  };
  for (const Storey& storey : map.building.storeys) {
    write(fmt::format("storey_{}", storey.id), storey.id);
  }
  if (paths.empty()) write("no_storey", std::nullopt);
  return paths;
}

}  // namespace slcmap::exporting
