// Sheets of paper with the plans and sections of a map: their sizes, scales and contents.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "export/plan/drawing.h"
#include "export/scene/options.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// A sheet, lying, and the scale of what is on it. Millimetres.
struct SheetFormat {
  int scale = 50;           // 1 : scale
  std::string name = "A4";  // A4 to A0
  Eigen::Vector2d size_mm{297, 210};

  Eigen::Vector2d Corner_mm() const;  // the lower left one of the area within the border, above
  Eigen::Vector2d Area_mm() const;    // the title block, and its size
  // Where the middle of the building comes to lie.
  Eigen::Vector2d Middle_mm() const;
};

// What a sheet has around the plan and below it.
inline constexpr double kSheetBorder_mm = 8, kTitleBlock_mm = 30;

// The wanted scale on the smallest sheet that holds the extent (width and height) of all storeys
// with its dimensions; without a wanted one, 1:50 where A2 does, else 1:100, and smaller only where
// A0 does not. Throws ConfigError for options that cannot be and where no sheet holds the wanted
// scale, DataError for a building that is larger than any or not finite.
SheetFormat ChooseFormat(const Eigen::Vector2d& extent_m, const PlanOptions& options);

// Sheets of paper with the plans of a map.

// Millimetres from the lower left corner.
struct Sheet {
  std::string name;     // of its file, without an ending
  std::string title;    // "Storey 0"
  std::string project;  // what the map is of; "" where that is not known
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();
  Drawing drawing;
};

// What a file of the sheet is called by viewers: "office, storey 0".
std::string FormatTitle(const Sheet& sheet);

// A sheet a storey, from the lowest ("storey_0", ...), each with title block, legend, an arrow to
// the north and scale bar. Of a
// map without storeys one sheet, "no_storey", that says so. Throws what MakePlans does.
std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options);

// A sheet as an SVG file in millimetres, with a group a pen and text as text; browsers print it in
// its size.
std::string MakeSvg(const Sheet& sheet);

// Sections and elevations of a map on sheets of paper.

// A sheet each, with the title block of plans, in the order of SectionViews; none where options ask
// for none. Throws what MakeSections does.
std::vector<Sheet> MakeSectionSheets(const MapResult& map, const PlanOptions& options);

// The plan of a storey, from which sheets and CAD files are drawn.

// Metres, in the frame of exports: x and y along the main heading.
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

// What was built otherwise than it was planned, drawn over the plan of a storey.

// In the frame of StoreyPlan: where deviating and missing walls and openings were planned, dashed;
// by how many millimetres they are off, with the standard deviation, and which are missing or new.
// Nothing of a storey that was not held against a plan.
Drawing DrawPlanDeviations(const MapResult& map, const Storey& storey, const PlanTextSizes& sizes);

}  // namespace slcmap::exporting
