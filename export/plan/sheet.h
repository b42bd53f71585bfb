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
  std::string title;    // "Storey 0"
  std::string project;  // what the map is of; "" where that is not known
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();
  Drawing drawing;
};

// What a file of the sheet is called by viewers: "office, storey 0".
std::string TitleOf(const Sheet& sheet);

// A sheet a storey, from the lowest ("storey_0", ...), each with title block, legend, an arrow to
// the north and scale bar. Of a
// map without storeys one sheet, "no_storey", that says so. Throws what MakePlans does.
std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options);

}  // namespace slcmap
