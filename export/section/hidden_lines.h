// Which lines of a view are hidden by what is before them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "export/plan/drawing.h"

namespace slcmap {

// A line of a view: x to the right, y up, z away from the eye. Metres.
struct ViewedLine {
  Pen pen = Pen::kBeyond;
  Eigen::Vector3d start, end;
  double before_m = 0;  // what is nearer to it than that does not hide it
};

// An upright rectangle, at those depths at its left and right.
struct Screen {
  Eigen::AlignedBox2d box;
  double left_m = 0, right_m = 0;
};

// Whether a screen lies before a point, by more than that.
bool IsHidden(const std::vector<Screen>& screens, const Eigen::Vector3d& point, double before_m);

// What is seen of the lines, from a depth of 0 on, within a window; each part once: level and
// upright ones of a pen that overlap are one.
std::vector<DrawnPath> SeenParts(const std::vector<ViewedLine>& lines,
                                 const std::vector<Screen>& screens,
                                 const Eigen::AlignedBox3d& window);

}  // namespace slcmap
