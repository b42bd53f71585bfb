// What the surfaces beside a line are like.
#pragma once

#include <vector>

#include "mapping/dense/dense_index.h"
#include "mapping/dense/dense_point.h"
#include "mapping/lines/line_in_view.h"

namespace slcmap {

// How much of a line is on a flat surface that goes on at both of its sides, and of how much is
// another known: that it ends there, bends, or is partly hidden by one in front of it.
struct SurfacesBeside {
  double flat_m = 0, relief_m = 0, unknown_m = 0;
};

// The surfaces that a dense cloud shows, to be asked for at many lines.
class LineSurfaces {
 public:
  explicit LineSurfaces(const std::vector<DensePoint>& cloud);

  // In stretches of 10 cm, by the points up to 15 cm around them.
  SurfacesBeside Beside(const PointAndDirection& line, const std::vector<Stretch>& intervals) const;

 private:
  enum class Surface { kFlat, kRelief, kUnknown };
  Surface At(const Eigen::Vector3d& p_world, const Eigen::Vector3d& direction_world) const;

  std::vector<DensePoint> cloud_;
  DenseIndex index_;
};

}  // namespace slcmap
