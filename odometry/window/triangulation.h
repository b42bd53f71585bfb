// The inverse depth of a point from everything that has seen it.
#pragma once

#include <optional>

#include "odometry/window/options.h"
#include "odometry/window/window_state.h"

namespace slcmap {

// The inverse depth (1 / m, in the host's left camera) that fits all measurements of the landmark
// best: linear least squares, then Gauss-Newton on the reprojections. Nothing where the rays are
// too parallel, the point lies behind a camera, or the fit is poor.
std::optional<double> TriangulateInverseDepth(const PointLandmark& landmark,
                                              const StereoGeometry& geometry,
                                              const PointTriangulationOptions& options);

}  // namespace slcmap
