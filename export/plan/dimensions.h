// Dimensions of a plan: which there are, and how one is drawn. Metres, in the plan's frame.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "export/plan/drawing.h"
#include "export/scene/building_solids.h"

namespace slcmap::inline exporting {

// The distance from one point to another, written beside a line that is parallel to it.
struct Dimension {
  Eigen::Vector2d from, to;
  double offset_m = 0;    // of the line, to the left of the direction from -> to
  double text_at = 0.5;   // where along the line the text stands, 0 to 1
  int text_row = 0;       // 0 on the line, as it is read; 1 above that; -1 under the line
  bool is_about = false;  // an end was not measured
  bool in_mm = false;     // the text is in millimetres

  double Length() const { return (to - from).norm(); }
  Eigen::Vector2d LineEnd() const;  // where the line ends, beside `to`
  // In metres and centimetres, or in millimetres; "~4.00" where it is about so long.
  std::string Text() const;
};

// "4.00" or, in millimetres, "4000".
std::string LengthText(double length_m, bool in_mm);

// How large texts of a plan are, and what lies around them: metres in the building.
struct PlanTextSizes {
  explicit PlanTextSizes(int scale, bool millimetres = false);
  double name_m, figure_m, small_m;  // heights of capitals: room names; dimensions, areas; openings
  double gap_m;                      // between a line and its text
  double row_m;                      // from one chain of dimensions to the next
  bool in_mm;                        // lengths are written in millimetres
};

// The line with its ticks, extension lines and the text. Heights are those of the text.
Drawing DrawDimension(const Dimension& dimension, const PlanTextSizes& sizes);

// The text alone, as it is read from below or from the right.
DrawnText DimensionText(const Dimension& dimension, const PlanTextSizes& sizes);

// Between opposite sides of a room, at least half a metre long and parallel within a degree, that
// walls stand at: one for each two, where there is room for it and no wall between them. What is
// placed is taken.
std::vector<Dimension> RoomDimensions(const Polygon& room, const PlanTextSizes& sizes,
                                      TakenPlaces* taken);

// What a chain of dimensions goes to: a side of a wall across it, or a height.
struct ChainMark {
  double at_m = 0;      // along the axis
  double weight_m = 0;  // of a wall, its length
  const PlanWall* wall = nullptr;
  bool assumed = false;  // nobody saw it
};

// A side of what is drawn, from which it is measured: along an axis (0 x, 1 y), and whether it is
// the upper one across that.
struct Outside {
  int axis = 0;
  bool upper = false;
};

// A chain outside of an extent and, of more than two marks, a second one from the first to the
// last. Of marks of two walls that lie too near for a text between them, the heavier are taken.
std::vector<Dimension> ChainsOutside(const Outside& outside, const Eigen::AlignedBox2d& extent,
                                     const std::vector<ChainMark>& marks,
                                     const PlanTextSizes& sizes);

// Chains on all four sides of walls and rooms: the sides of those walls across them that can be
// seen from there, and a second one from the first to the last. Of sides of walls that lie too near
// for a text between them, those of longer walls are taken; the two sides of one wall stay. Where
// one was not measured, they are about so long. Where no wall is along an axis, they are along the
// longest one.
std::vector<Dimension> OuterChains(std::vector<WallSolid> solids, std::vector<Polygon> rooms,
                                   const PlanTextSizes& sizes);

}  // namespace slcmap::exporting
