// Sheets of paper with the plans of a map.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/plan_options.h"
#include "mapping/map.h"

namespace slcmap {

// Millimetres from the lower left corner.
struct Sheet {
  std::string name;  // of its file, without an ending
  std::string title;
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();
  Drawing drawing;
};

// A sheet a storey, from the lowest ("storey_0", ...), each with title, legend and scale bar. Of a
// map without storeys one sheet, "no_storey", that says so. Throws what MakePlans does.
std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options);

}  // namespace slcmap
