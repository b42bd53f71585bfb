// A map against a plan of its building, as commands do it.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/map.h"
#include "mapping/plan/building_plan.h"

namespace slcmap::inline commands {

// A rough place by the text X,Y,Z,YAW_DEG, or with two lengths X,Y,YAW_DEG; none of "". Throws
// ConfigError, which names the option.
std::optional<RoughStart> ParseStart(const std::string& option, size_t lengths,
                                     const std::string& at);

struct PlanArguments {
  std::string plan;    // a file or a map folder; "": none
  double pixel_m = 0;  // of an image; 0: not said
  std::string at;      // about where the map's origin is, as --plan-at says it
};

// Adds --plan, --plan-pixel-m and --plan-at; `arguments` must outlive the parsing. Returns --plan.
CLI::Option* AddPlanOptions(CLI::App& command, PlanArguments* arguments);

// The plan is read before the work begins. A map that has no place in it is a map all the same: it
// is kept, and what is wrong is said in the end.
class PlanStage {
 public:
  // Throws ConfigError and DataError for a plan that is none.
  explicit PlanStage(const PlanArguments& arguments);

  // Puts the comparison into the map; nothing where no plan was given.
  void Compare(const Progress& progress, MapResult* map);

  // Throws DataError where the map had no place in the plan.
  void RequirePlaced() const;

 private:
  const PlanArguments arguments_;
  const std::optional<RoughStart> start_;  // of --plan-at
  std::vector<BuildingPlan> plans_;
  std::string fault_;
};

}  // namespace slcmap::commands
