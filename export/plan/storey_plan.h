// The plan of a storey, from which sheets and CAD files are drawn.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "export/plan/dimensions.h"
#include "export/plan/drawing.h"
#include "export/plan/sheet.h"
#include "export/scene/options.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// Metres in the frame of Building::T_map_world: x and y along the main heading.
struct StoreyPlan {
  Storey storey;
  Drawing walls;                      // areas, and the paths of their borders
  Drawing openings;                   // paths
  Drawing sections;                   // where it is cut: paths, and numbers
  Drawing rooms;                      // paths of their borders, and from names to small ones
  std::vector<DrawnText> room_texts;  // names, areas and heights
  std::vector<DrawnText> wall_texts;  // of openings, and of walls where that is wanted
  std::vector<Dimension> dimensions;
};

// All storeys at one scale, from the lowest.
struct PlanSet {
  SheetFormat format;
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();  // of the walls and rooms of all storeys
  std::vector<StoreyPlan> storeys;
};

// Throws what ChooseFormat does.
PlanSet MakePlans(const Building& building, const PlanOptions& options);

}  // namespace slcmap::exporting
