// Which scale and which sheet of paper hold the plans of a building.
#pragma once

#include <Eigen/Core>
#include <string>

#include "export/plan/plan_options.h"

namespace slcmap {

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

}  // namespace slcmap
