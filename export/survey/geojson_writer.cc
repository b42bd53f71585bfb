// GeoJSON: a file a storey.
#include <spdlog/fmt/fmt.h>

#include "data/io/json.h"
#include "export/survey/storey_features.h"
#include "export/survey/survey_points.h"
#include "export/survey/survey_writers.h"

namespace slcmap::inline exporting {
namespace {

Json Closed(const PlanPoints& ring) {
  Json points = Json::array();
  for (const Eigen::Vector2d& p : ring) points.push_back(PointJson(p));
  points.push_back(PointJson(ring.front()));
  return points;
}

Json AreasJson(const std::vector<Polygon>& areas) {
  Json polygons = Json::array();
  for (const Polygon& area : areas) {
    Json rings = Json::array({Closed(area.outline)});
    for (const PlanPoints& hole : area.holes) rings.push_back(Closed(hole));
    polygons.push_back(rings);
  }
  if (polygons.size() == 1) return {{"type", "Polygon"}, {"coordinates", polygons.front()}};
  return {{"type", "MultiPolygon"}, {"coordinates", polygons}};
}

Json LineJson(const std::vector<Eigen::Vector3d>& line, bool in_space) {
  Json points = Json::array();
  for (const Eigen::Vector3d& p : line) {
    points.push_back(in_space ? PointJson(p) : PointJson(Eigen::Vector2d(p.head<2>())));
  }
  return {{"type", "LineString"}, {"coordinates", points}};
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

Json FeatureJson(const FeatureLayer& layer, const StoreyFeature& feature) {
  const bool is_area = layer.geometry == FeatureGeometry::kAreas;
  Json properties = {{"feature", layer.feature}};
  for (std::size_t i = 0; i < layer.columns.size(); ++i) {
    properties[layer.columns[i].name] = AttributeJson(feature.attributes[i]);
  }
  return {{"type", "Feature"},
          {"properties", properties},
          {"geometry",
           is_area ? AreasJson(feature.areas)
                   : LineJson(feature.line, layer.geometry == FeatureGeometry::kLineInSpace)}};
}

// RFC 7946 knows degrees alone; that these are metres is said as its forerunner of 2008 did.
Json CrsJson(const std::string& crs) {
  const int epsg = EpsgCode(crs);
  const std::string name =
      epsg > 0 ? fmt::format("urn:ogc:def:crs:EPSG::{}", epsg) : std::string(kLocalCrs);
  return {{"type", "name"}, {"properties", {{"name", name}}}};
}

Json StoreyJson(const MapResult& map, const std::vector<FeatureLayer>& layers,
                const std::optional<int64_t>& storey) {
  Json features = Json::array();
  for (const FeatureLayer& layer : layers) {
    for (const StoreyFeature& feature : layer.features) {
      if (feature.storey == storey) features.push_back(FeatureJson(layer, feature));
    }
  }
  Json plan = {{"map", map.id}, {"units", "metres"}};
  if (storey) plan["storey"] = *storey;
  return {{"type", "FeatureCollection"},
          {"crs", CrsJson(FindPlace(map.source).crs)},
          {"slcmap", plan},
          {"features", features}};
}

}  // namespace

std::vector<std::string> GeoJsonWriter::Write(const std::string& folder, const MapResult& map,
                                              const Progress& progress) const {
  progress.ReportOrStop(0);
  MakeFolder(folder + "/plan");
  const std::vector<FeatureLayer> layers = MakeFeatureLayers(map);
  std::vector<std::string> paths;
  const auto write = [&](const std::string& name, const std::optional<int64_t>& storey) {
    paths.push_back(fmt::format("{}/plan/{}.geojson", folder, name));
    // In one line: indented, each coordinate would have its own.
    WriteFile(paths.back(), StoreyJson(map, layers, storey).dump() + "\n");
  };
  for (const Storey& storey : map.building.storeys) {
    write(fmt::format("storey_{}", storey.id), storey.id);
  }
  if (paths.empty()) write("no_storey", std::nullopt);
  progress.ReportOrStop(1);
  return paths;
}

}  // namespace slcmap::exporting
