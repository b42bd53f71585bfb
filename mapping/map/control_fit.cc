#include "mapping/map/control_fit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline mapping {
namespace {

constexpr char kControlFormat[] = "slcmap georeference";
constexpr int kControlVersion = 1;
constexpr double kMostCoordinate_m = 1e8, kMostSigma_m = 1e6;

const char* NameStatus(ControlStatus status) {
  return kControlStatuses[static_cast<std::size_t>(status)];
}

Json ControlRow(const ControlResidual& point) {
  Json json = {{"name", point.name},
               {"status", NameStatus(point.status)},
               {"given_m", PointJson(point.given_m)},
               {"sigma_m", PointJson(point.sigma_m)},
               {"views", point.views}};
  if (point.status == ControlStatus::kUnseen) return json;
  json["off_m"] = PointJson(point.off_m);
  json["over_sigma"] = RoundedForJson(point.over_sigma);
  return json;
}

ControlResidual ParseControlRow(const std::string& path, const Json& json) {
  using Eigen::Vector3d;
  ControlResidual point;
  point.name = json.at("name").get<std::string>();
  const std::string place = path + ": " + point.name, status = json.at("status").get<std::string>();
  const auto known = std::ranges::find(kControlStatuses, status);
  if (known == kControlStatuses.end()) {
    throw DataError(fmt::format("{}: status: found '{}', expected one of {}", place, status,
                                fmt::join(kControlStatuses, ", ")));
  }
  point.status = static_cast<ControlStatus>(known - kControlStatuses.begin());
  point.given_m = ParsePoint<Vector3d>(place, json.at("given_m"), kMostCoordinate_m);
  point.sigma_m = ParsePoint<Vector3d>(place, json.at("sigma_m"), kMostSigma_m);
  point.views = BoundedAt(place, json, "views", 0, 1000000);
  if (point.status == ControlStatus::kUnseen) return point;
  point.off_m = ParsePoint<Vector3d>(place, json.at("off_m"), kMostCoordinate_m);
  point.over_sigma = BoundedAt(place, json, "over_sigma", 0.0, 1e12);
  return point;
}

std::string ControlTable(const ControlFit& fit) {
  std::string table =
      "name,status,easting_m,northing_m,height_m,sigma_easting_mm,sigma_northing_mm,"
      "sigma_height_mm,off_easting_mm,off_northing_mm,off_height_mm,off_mm,over_sigma,views\n";
  for (const ControlResidual& p : fit.points) {
    const Eigen::Vector3d sigma_mm = 1e3 * p.sigma_m, off_mm = 1e3 * p.off_m;
    table += fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.1f},{:.1f},{:.1f},", p.name,
                         NameStatus(p.status), p.given_m.x(), p.given_m.y(), p.given_m.z(),
                         sigma_mm.x(), sigma_mm.y(), sigma_mm.z());
    table += p.status == ControlStatus::kUnseen
                 ? fmt::format(",,,,,{}\n", p.views)
                 : fmt::format("{:.1f},{:.1f},{:.1f},{:.1f},{:.2f},{}\n", off_mm.x(), off_mm.y(),
                               off_mm.z(), off_mm.norm(), p.over_sigma, p.views);
  }
  return table;
}

// What programs that know of no map want to know of the place.
Json PlaceJson(const Georeference& georeference) {
  Json json = GeoreferenceJson(georeference);
  if (georeference.crs.empty()) return json;
  const CoordinateSystem system(georeference.crs);
  json["crs_name"] = system.title();
  const auto place = system.At(georeference.origin_m);
  if (!place) return json;
  json["latitude_deg"] = place->latitude_deg;
  json["longitude_deg"] = place->longitude_deg;
  json["true_north_of_grid_north_deg"] = place->true_north_rad * kDegreesPerRadian;
  return json;
}

}  // namespace

void WriteControlFit(const std::string& folder, const ControlFit& fit,
                     const std::optional<Georeference>& georeference) {
  Json json = {{"format", kControlFormat},
               {"version", kControlVersion},
               {"georeference", georeference ? PlaceJson(*georeference) : Json()},
               {"rms_mm", RoundedForJson(1e3 * fit.rms_m)},
               {"map_scale", fit.map_scale},
               {"map_scale_sigma", fit.map_scale_sigma},
               {"points", Json::array()},
               {"distances", Json::array()}};
  for (const ControlResidual& point : fit.points) json["points"].push_back(ControlRow(point));
  for (const DistanceResidual& d : fit.distances) {
    json["distances"].push_back({{"from", d.from},
                                 {"to", d.to},
                                 {"given_m", RoundedForJson(d.given_m)},
                                 {"mapped_m", RoundedForJson(d.mapped_m)},
                                 {"sigma_m", RoundedForJson(d.sigma_m)}});
  }
  WriteJsonFile(folder + "/" + kControlFiles[0], json);
  WriteFile(folder + "/" + kControlFiles[1], ControlTable(fit));
}

ControlFit ReadControlFit(const std::string& folder) {
  const std::string path = folder + "/" + kControlFiles[0];
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, kControlFormat, kControlVersion, kControlVersion);
    ControlFit fit;
    fit.rms_m = 1e-3 * BoundedAt(path, json, "rms_mm", 0.0, 1e12);
    fit.map_scale = BoundedAt(path, json, "map_scale", 0.0, 1e6);
    fit.map_scale_sigma = BoundedAt(path, json, "map_scale_sigma", 0.0, 1e6);
    for (const Json& row : json.at("points")) fit.points.push_back(ParseControlRow(path, row));
    for (const Json& row : json.at("distances")) {
      fit.distances.push_back({row.at("from").get<std::string>(), row.at("to").get<std::string>(),
                               BoundedAt(path, row, "given_m", 0.0, kMostCoordinate_m),
                               BoundedAt(path, row, "mapped_m", 0.0, kMostCoordinate_m),
                               BoundedAt(path, row, "sigma_m", 0.0, kMostSigma_m)});
    }
    return fit;
  });
}

}  // namespace slcmap::mapping
