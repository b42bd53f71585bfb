// A line of the world as a rectified camera sees it.
#pragma once

#include <optional>

#include "data/stretch.h"
#include "data/types.h"
#include "odometry/geometry/general_line.h"

namespace slcmap {

// The part of a line that is in an image, from start to end as the line runs.
struct LineInView {
  LineSegment px;
  double from_m = 0, to_m = 0;  // of its ends, along the line from its point
  double start_depth_m = 0, end_depth_m = 0;

  // The place along the line of what is seen at a share of the way from px.start to px.end, and
  // its depth.
  double AlongAt(double share) const;
  double DepthAt(double share) const;
};

// Nothing where no part of the stretch lies in the image (but a margin) and between the depths.
struct ViewLimits {
  double margin_px = 4;
  double min_depth_m = 0.2, max_depth_m = 10;
};
std::optional<LineInView> SeenPart(const PointAndDirection& line, const Stretch& stretch,
                                   const RigidTransform& T_camera_world, const Camera& camera,
                                   const ViewLimits& limits);

}  // namespace slcmap
