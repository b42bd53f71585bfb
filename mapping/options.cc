#include "mapping/options.h"

#include <spdlog/fmt/fmt.h>

namespace slcmap {
namespace {

void Require(bool condition, const char* key, double found, const char* expected) {
  if (!condition) throw ConfigError(fmt::format("{}: found {}, expected {}", key, found, expected));
}

}  // namespace

void CloudOptions::Check() const {
  Require(max_sigma_m > 0, "mapping.cloud.max_sigma_m", max_sigma_m, "more than 0");
  Require(min_observations >= 1, "mapping.cloud.min_observations", min_observations, "at least 1");
  Require(voxel_m > 0, "mapping.cloud.voxel_m", voxel_m, "more than 0");
  Require(outlier_neighbours >= 1, "mapping.cloud.outlier_neighbours", outlier_neighbours,
          "at least 1");
  Require(outlier_sigmas > 0, "mapping.cloud.outlier_sigmas", outlier_sigmas, "more than 0");
}

void CloudOptions::Read(YamlSection section) {
  section.Read("max_sigma_m", &max_sigma_m);
  section.Read("min_observations", &min_observations);
  section.Read("voxel_m", &voxel_m);
  section.Read("outlier_neighbours", &outlier_neighbours);
  section.Read("outlier_sigmas", &outlier_sigmas);
  section.Finish();
}

void OccupancyOptions::Check() const {
  Require(resolution_m >= 0.001, "mapping.occupancy.resolution_m", resolution_m, "at least 0.001");
  Require(max_range_m > 0, "mapping.occupancy.max_range_m", max_range_m, "more than 0");
}

void OccupancyOptions::Read(YamlSection section) {
  section.Read("resolution_m", &resolution_m);
  section.Read("max_range_m", &max_range_m);
  section.Finish();
}

void LineMapOptions::Check() const {
  Require(max_sigma_m > 0, "mapping.lines.max_sigma_m", max_sigma_m, "more than 0");
  Require(min_observations >= 1, "mapping.lines.min_observations", min_observations, "at least 1");
}

void LineMapOptions::Read(YamlSection section) {
  section.Read("max_sigma_m", &max_sigma_m);
  section.Read("min_observations", &min_observations);
  section.Finish();
}

MappingOptions MappingOptions::FromYaml(const std::string& path) {
  MappingOptions options;
  YamlSection section = YamlSection::FromFile(path).Section("mapping");
  options.cloud.Read(section.Section("cloud"));
  options.occupancy.Read(section.Section("occupancy"));
  options.lines.Read(section.Section("lines"));
  section.Finish();
  options.Check();
  return options;
}

void MappingOptions::Check() const {
  cloud.Check();
  occupancy.Check();
  lines.Check();
}

}  // namespace slcmap
