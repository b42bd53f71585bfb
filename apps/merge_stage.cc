#include "apps/merge_stage.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "apps/commands.h"
#include "data/error.h"
#include "data/text_row.h"
#include "mapping/merge/alignment_features.h"
#include "mapping/merge/merge_maps.h"

namespace slcmap {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kFarthestStart_m = 1e5, kMostTurn_deg = 360;

[[noreturn]] void FailStart(const std::string& at) {
  throw ConfigError(
      fmt::format("--at: found '{}', expected X,Y,Z,YAW_DEG: four numbers, metres of at most "
                  "{:.0f} and degrees "
                  "of at most {:.0f}",
                  at, kFarthestStart_m, kMostTurn_deg));
}

void LogAlignment(const std::string& name, const MapAlignment& found) {
  const Eigen::Vector3d& p = found.T_first_second.translation;
  spdlog::info(
      "{}: lies at {:.3f}, {:.3f}, {:.3f} m, turned by {:.2f} degrees; {:.0f} m2 of surfaces and "
      "{:.0f} m of lines agree, {:.1f} % of the surfaces contradict, the next best place explains "
      "{:.0f} % as much of what tells the two apart",
      name, p.x(), p.y(), p.z(), YawOf(found.T_first_second) / kDegree_rad, found.surfaces_m2,
      found.lines_m, 100 * found.contradiction, 100 * found.rival_share);
}

}  // namespace

CLI::Option* AddStartOption(CLI::App& command, std::string* at) {
  return command
      .add_option("--at", *at,
                  "Rough place of the second map's origin in the first one's world, and its turn "
                  "about z: looked for within 2 m, 1 m of height and 20 degrees of it")
      ->type_name("X,Y,Z,YAW_DEG");
}

std::optional<RoughStart> ParseStart(const std::string& at) {
  if (at.empty()) return std::nullopt;
  std::vector<double> values;
  for (std::size_t from = 0; from <= at.size();) {
    const std::size_t to = std::min(at.find(',', from), at.size());
    const std::optional<double> value = ParseNumber(at.substr(from, to - from));
    if (!value || !std::isfinite(*value)) FailStart(at);
    values.push_back(*value);
    from = to + 1;
  }
  if (values.size() != 4 || std::abs(values[3]) > kMostTurn_deg) FailStart(at);
  const RoughStart start{{values[0], values[1], values[2]}, values[3] * kDegree_rad};
  if (start.p_world.cwiseAbs().maxCoeff() > kFarthestStart_m) FailStart(at);
  return start;
}

MappingOptions OptionsOfMerging(const std::string& config, const std::string& first_map) {
  if (!config.empty()) return MappingOptions::FromYaml(config);
  try {
    return MappingOptions::FromYaml(first_map + "/options.yaml");
  } catch (const ConfigError& error) {
    throw ConfigError(std::string(error.what()) +
                      "; of a map by another version --config can stand for its options");
  }
}

MapResult MergeStage(MapResult first, MapResult second, const std::string& second_name,
                     const std::string& at, const MappingOptions& options,
                     const Progress& progress) {
  AlignmentOptions alignment;
  alignment.start = ParseStart(at);
  try {
    MergedMaps merged =
        MergeMaps(std::move(first), std::move(second), alignment, options, progress);
    LogAlignment(second_name, merged.alignment);
    return std::move(merged.map);
  } catch (const DataError& error) {
    throw DataError(second_name + ": " + error.what());
  }
}

}  // namespace slcmap
