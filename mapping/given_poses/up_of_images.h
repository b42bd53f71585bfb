// Where up is in the world of poses, by what their images show.
#pragma once

#include <optional>

#include "data/sequence.h"
#include "data/trajectory.h"

namespace slcmap {

// For recordings without an IMU: where the images' own up is far from z of the world, the direction
// near it that most length of edges follows. Nothing where the images are upright with z, or where
// edges do not tell.
std::optional<Eigen::Vector3d> UpByImages(const Sequence& recording, const Trajectory& trajectory);

}  // namespace slcmap
