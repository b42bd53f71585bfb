// How what was measured of a mapped building is told.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/evaluation/building_metrics.h"

namespace slcmap {

// Files, as the user named them.
struct BuildingInputs {
  std::string planes;         // planes.json of a map; the other files of the building beside it
  std::string true_building;  // truth/building.json of a simulated sequence
};

std::string BuildingTable(const BuildingInputs& inputs, const BuildingMetrics& metrics);
nlohmann::ordered_json BuildingJson(const BuildingInputs& inputs, const BuildingMetrics& metrics);

// Draws a plan: true walls and rooms, over them what was mapped. Throws OutputError.
void WriteBuildingPlan(const std::string& path, const TrueBuilding& truth,
                       const Building& building);

}  // namespace slcmap
