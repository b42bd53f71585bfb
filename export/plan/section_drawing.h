// A section or an elevation with its dimensions, from which sheets and CAD files are drawn.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "export/plan/dimensions.h"
#include "export/plan/drawing.h"
#include "export/plan/section_view.h"
#include "export/plan/sheet.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// Metres: x as the view says, y the height in world.
struct SectionDrawing {
  SectionView view;
  SheetFormat format;
  Eigen::AlignedBox2d extent;
  Drawing shape;                 // areas and paths
  std::vector<DrawnText> texts;  // rooms, sizes of openings, heights over the lowest floor
  std::vector<DrawnPath> marks;  // of the heights
  std::vector<Dimension> dimensions;
};

// The sections and elevations that options ask for, each at the scale that ChooseFormat finds for
// it. Throws what SectionViews and ChooseFormat do.
std::vector<SectionDrawing> MakeSections(const MapResult& map, const PlanOptions& options);

}  // namespace slcmap::exporting
