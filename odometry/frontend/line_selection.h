// Chooses which of the segments found become tracked lines.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/camera.h"
#include "data/types.h"

namespace slcmap {

// The axis (index into axes_camera, unit) whose vanishing point a segment of a pinhole image points
// to, or -1. Of no concern how certain that is: it ranks what is tracked, and the LineClassifier
// judges it later.
int AxisOf(const LineSegment& segment, const Camera& camera,
           const std::vector<Eigen::Vector3d>& axes_camera);

// The indices of at most `room` candidates that are long, lie along an axis, and are spread over
// image and directions, given those that are `kept` already. Best first.
std::vector<int> SelectSegments(const std::vector<LineSegment>& candidates,
                                const std::vector<LineSegment>& kept, const Camera& camera,
                                const std::vector<Eigen::Vector3d>& axes_camera, int room);

}  // namespace slcmap
