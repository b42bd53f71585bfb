// The inverse depth of a point from everything that has seen it.
#pragma once

#include <optional>

#include "odometry/window/window_state.h"

namespace slcmap {

struct TriangulationOptions {
  double min_parallax_rad = 0.01;  // between the host's ray and some other one
  double max_residual_sigma = 4;   // RMS of the reprojections, in standard deviations
  double min_depth_m = 0.1;
  double max_depth_m = 300;
};

// The inverse depth (1 / m, in the host's left camera) that fits all measurements of the landmark
// best: linear least squares, then Gauss-Newton on the reprojections. Nothing where the rays are
// too parallel, the point lies behind a camera, or the fit is poor.
std::optional<double> TriangulateInverseDepth(const PointLandmark& landmark,
                                              const StereoGeometry& geometry,
                                              const TriangulationOptions& options);

}  // namespace slcmap
