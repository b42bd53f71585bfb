// The gyroscope's bias as images alone tell it, before anything else is known.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "odometry/window/window_state.h"

namespace slcmap {

// The bias in rad/s with which the rotations of the gyroscope fit the left images: between two
// frames the rays a and R b of every point and the direction of travel t lie in a plane, wherever
// the point is: t . (a x R b) = 0 (Kneip and Lynen, "Direct optimization of frame-to-frame
// rotation", ICCV 2013; over several pairs with one bias: He et al., "A rotation-translation-
// decoupled solution for robust and efficient visual-inertial initialization", CVPR 2023). Each
// pair of frames, `apart_s` or more from each other, has its own t, which is eliminated; the
// distances of points that do not fit weigh less. Needs neither scale nor accelerometer. Nothing
// where there are too few points.
std::optional<Eigen::Vector3d> GyroBiasFromImages(
    const std::vector<std::unique_ptr<FrameState>>& frames, const StereoGeometry& geometry,
    const ImuNoise& noise, double apart_s);

}  // namespace slcmap
