// Brings what frames measured before or after their stamps (see odometry/geometry/exposure.h) to
// these, by what is known of their motion and of the depth of what they show.
#pragma once

#include "odometry/geometry/exposure.h"
#include "odometry/window/problem.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

// How the body moves about the moment of a frame, as its state and what the IMU felt have it.
BodyMotion GetMotion(const FrameState& frame, const CalibrationState& calibration);

// Where a measurement would have been at the stamp: so placed, it has in a term of the window the
// residual that it has at its own time, by the states as they are. To be done again where they have
// changed. Where the readout is estimated, how it moves with that is told, too. Of what is not
// placed yet a depth is taken that both images of the frame show, or else that of what they show
// around it. Does nothing where all was exposed at the stamp.
void BringToStamp(const WindowState& window, const CostModel& model, FrameState* frame);

// Of all frames of the window.
void BringToStamps(const CostModel& model, WindowState* window);

}  // namespace slcmap::odometry
