// Lines and directions of a window as a frame's cameras see them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/types.h"
#include "odometry/line_prediction.h"
#include "odometry/window/window_state.h"

namespace slcmap {

// Where the estimated lines are expected in a frame's cameras, in pixels of the rectified images.
std::vector<LinePrediction> PredictLines(const WindowState& window, const FrameState& frame,
                                         const Rig& rectified_rig);

// The vertical, the horizontal axes of all known worlds, and all known slopes, in a frame's left
// camera.
std::vector<Eigen::Vector3d> AxesInCamera(const WindowState& window, const FrameState& frame,
                                          const Rig& rectified_rig);

// What a frame saw of lines, in pixels of the rectified cameras, which share their intrinsics.
std::vector<LineObservation> LinesInPixels(const FrameState& frame, const Camera& camera);

}  // namespace slcmap
