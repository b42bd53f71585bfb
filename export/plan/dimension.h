// Dimensions of a plan: which there are, and how one is drawn. Metres, in the plan's frame.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/taken_places.h"
#include "export/plan/wall_solids.h"

namespace slcmap {

// The distance from one point to another, written beside a line that is parallel to it.
struct Dimension {
  Eigen::Vector2d from, to;
  double offset_m = 0;    // of the line, to the left of the direction from -> to
  double text_at = 0.5;   // where along the line the text stands, 0 to 1
  bool is_below = false;  // the text is under the line, as it is read

  double Length() const { return (to - from).norm(); }
  Eigen::Vector2d LineEnd() const;  // where the line ends, beside `to`
  // In metres and centimetres.
  std::string Text() const;
};

// How large texts of a plan are, and what lies around them: metres in the building.
struct PlanTextSizes {
  explicit PlanTextSizes(int scale);
  double name_m, figure_m, small_m;  // heights of capitals: room names; dimensions, areas; openings
  double gap_m;                      // between a line and its text
  double row_m;                      // from one chain of dimensions to the next
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

// Chains below and to the left of all walls, along x and y: the faces of walls across them, and a
// second one from the first face to the last. Of faces that lie too near for a text between them,
// those of longer walls are taken; the two sides of a wall that was measured on both stay.
std::vector<Dimension> OuterChains(const std::vector<WallSolid>& solids,
                                   const PlanTextSizes& sizes);

}  // namespace slcmap
