// What the estimator expects to see of the lines that it knows.
#pragma once

#include <cstdint>
#include <optional>

#include "data/types.h"

namespace slcmap {

// Where a line that the estimator knows in 3D is expected in the next pair, in pixels of the
// rectified cameras, clipped to the image.
struct LinePrediction {
  int64_t id = 0;
  LineSegment left_px;
  std::optional<LineSegment> right_px;
  double sigma_px = 1;  // of its place across the line
};

}  // namespace slcmap
