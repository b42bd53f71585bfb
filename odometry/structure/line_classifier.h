// Which of a building's directions a line follows.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/types.h"
#include "odometry/structure/options.h"
#include "odometry/run.h"

namespace slcmap {

struct LineClass {
  LineAxis axis = LineAxis::kNone;
  int world = -1;  // index into the headings; -1 for the vertical, which all worlds share
  bool operator==(const LineClass&) const = default;
};

// The directions of the axes of Manhattan worlds, in the (gravity aligned, z up) world frame: the
// vertical, then X and Y of each heading (radians from the world's x about z), by world; worlds
// without one have no direction.
struct StructuralDirection {
  LineClass line_class;
  Eigen::Vector3d d_world = Eigen::Vector3d::UnitZ();
};
std::vector<StructuralDirection> StructuralDirections(
    const std::vector<std::optional<double>>& headings_rad);

// A class is given only when one direction fits and no other one could: a line that is taken for
// another axis bends all that it touches. Two more places ask which direction a segment follows,
// and are less strict on purpose. The votes of the ManhattanDetector are cast where no direction is
// known yet, and many decide together. The frontend's AxisOf() only prefers segments to track; this
// class judges them once they have been seen often enough.
class LineClassifier {
 public:
  // focal_px: of the rectified left camera. Throws ConfigError on options out of range.
  LineClassifier(const LineClassifierOptions& options, double focal_px);

  // The class of a segment on the plane z = 1 of a camera (SLC-VIO, section 3.4). Without headings
  // only the vertical is recognised.
  std::optional<LineClass> Classify(const LineSegment& segment,
                                    const Eigen::Matrix3d& R_world_camera,
                                    const std::vector<std::optional<double>>& headings_rad) const;

 private:
  LineClassifierOptions options_;
  double end_sigma_;  // on the plane z = 1
};

}  // namespace slcmap
