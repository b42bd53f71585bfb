#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "data/core/error.h"
#include "data/external/readers.h"
#include "data/io/file.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline mapping {
namespace {

PlanPoints OnPlan(const std::string& path, const std::vector<Eigen::Vector3d>& points) {
  PlanPoints places;
  for (const Eigen::Vector3d& p : points) {
    if (!(p.head<2>().norm() < 1e9)) {
      throw DataError(fmt::format("{}: found a line at {}, {}, expected places within 1e9 m", path,
                                  p.x(), p.y()));
    }
    places.emplace_back(p.head<2>());
  }
  return places;
}

// What a layer's name begins with names its storey, but for a discipline's letter: A-WALL, S-WALL.
std::string FindStorey(std::string_view before) {
  const bool is_short =
      before.size() == 1 || (before.size() == 2 && before.find_first_of("-_ ") == 1);
  const bool is_discipline = is_short && std::isalpha(static_cast<unsigned char>(before[0]));
  return std::string(is_discipline ? "" : before);
}

}  // namespace

std::vector<BuildingPlan> ReadDxfPlans(const std::string& path) {
  const std::string text = ReadFile(path);
  if (text.starts_with("AutoCAD Binary DXF")) {
    throw DataError(path + ": found a binary DXF file, expected a text one: save it as ASCII DXF");
  }
  std::map<std::string, std::vector<PlanPoints>> storeys;  // by what layers' names begin with
  std::set<std::string> other_layers;
  for (auto& [layer, points] : ReadDxfDrawing(path, text).lines) {
    std::ranges::transform(layer, layer.begin(), [](unsigned char c) { return std::toupper(c); });
    const std::size_t at = std::min(layer.find("WALL"), layer.find("WAND"));
    if (at == std::string::npos) {
      other_layers.insert(layer);
    } else {
      storeys[FindStorey(layer.substr(0, at))].push_back(OnPlan(path, points));
    }
  }
  if (storeys.empty() && other_layers.empty()) {
    throw DataError(path +
                    ": found no lines, expected those of walls on layers named WALL: blocks, "
                    "hatches and solids are not read, explode them");
  }
  if (storeys.empty()) {
    throw DataError(fmt::format(
        "{}: found lines on the layers '{}', expected some on layers named WALL: rename those of "
        "walls",
        path, fmt::join(other_layers, "', '")));
  }
  std::vector<BuildingPlan> plans;
  for (const auto& [name, lines] : storeys) {
    plans.emplace_back();
    plans.back().name = name;
    AddLines(lines, &plans.back());
  }
  return plans;
}

}  // namespace slcmap::mapping
