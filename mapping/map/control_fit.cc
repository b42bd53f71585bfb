#include "mapping/map/control_fit.h"

#include <spdlog/fmt/fmt.h>

#include "data/core/coordinate_system.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/json_fields.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline mapping {
namespace {

constexpr char kControlFormat[] = "slcmap georeference";
constexpr int kControlVersion = 1;
constexpr double kMostCoordinate_m = 1e8, kMostSigma_m = 1e6;
constexpr int64_t kMostViews = 1000000;

const char* NameStatus(ControlStatus status) {
  return kControlStatuses[static_cast<std::size_t>(status)];
}

}  // namespace

template <typename Fields>
void Describe(Fields& fields, Of<ControlResidual> auto& point) {
  fields.Value("name", point.name);
  fields.Place("point", point.name);
  fields.Named("status", point.status, kControlStatuses);
  fields.Point("given_m", point.given_m, kMostCoordinate_m);
  fields.Point("sigma_m", point.sigma_m, kMostSigma_m);
  fields.Integer("views", point.views, 0, kMostViews);
  if (point.status == ControlStatus::kUnseen) return;
  fields.Point("off_m", point.off_m, kMostCoordinate_m);
  fields.Number("over_sigma", point.over_sigma, 0, 1e12);
}

template <typename Fields>
void Describe(Fields& fields, Of<DistanceResidual> auto& distance) {
  fields.Value("from", distance.from);
  fields.Value("to", distance.to);
  fields.Number("given_m", distance.given_m, 0, kMostCoordinate_m);
  fields.Number("mapped_m", distance.mapped_m, 0, kMostCoordinate_m);
  fields.Number("sigma_m", distance.sigma_m, 0, kMostSigma_m);
}

namespace {

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
               {"points", JsonWriter::WriteList(fit.points)},
               {"distances", JsonWriter::WriteList(fit.distances)}};
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
    fit.points = JsonReader::ReadList<ControlResidual>(path, json.at("points"));
    fit.distances = JsonReader::ReadList<DistanceResidual>(path, json.at("distances"));
    return fit;
  });
}

}  // namespace slcmap::mapping
