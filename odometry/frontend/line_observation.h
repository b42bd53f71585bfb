// Straight segments in the rectified images, and the lines they are sights of.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "data/line_axis.h"

namespace slcmap {

// A straight segment, in pixels of a rectified image or on the plane z = 1 of a camera (the name of
// what holds it says which). Which end is the start means nothing.
struct LineSegment {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  Eigen::Vector2d end = Eigen::Vector2d::Zero();

  Eigen::Vector2d Midpoint() const { return 0.5 * (start + end); }
  double Length() const { return (end - start).norm(); }
};

// A tracked line in one stereo pair, in pixels of the rectified cameras. Ends along the line are
// not repeatable: they say how far it was seen, not where it stops.
struct LineObservation {
  int64_t id = 0;
  LineSegment left_px;
  std::optional<LineSegment> right_px;
};

// Where a line that the estimator knows in 3D is expected in the next pair, in pixels of the
// rectified cameras, clipped to the image.
struct LinePrediction {
  int64_t id = 0;
  LineSegment left_px;
  std::optional<LineSegment> right_px;
  double sigma_px = 1;  // of its place across the line
};

}  // namespace slcmap
