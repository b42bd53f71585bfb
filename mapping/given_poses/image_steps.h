// How the rig moved between pairs of images, by the images alone.
#pragma once

#include <cstdint>
#include <vector>

#include "data/progress.h"
#include "data/sequence.h"
#include "mapping/views/view.h"

namespace slcmap {

// A movement of the IMU between two stamps.
struct BodyStep {
  int64_t from_ns = 0, to_ns = 0;
  RigidTransform T_from_to;  // metres
  // How well it is known; 0 of exact ones.
  double turn_sigma_rad = 0, way_sigma_m = 0;
};

// Pairs of images that are about `spacing_s` apart, evenly over the recording, at most 40; of those
// with stamps among `preferred_ns` (sorted), where these are enough.
std::vector<std::pair<size_t, size_t>> PairsToCompare(const std::vector<StereoEntry>& images,
                                                      const std::vector<int64_t>& preferred_ns,
                                                      double spacing_s);

// The movement between images of each pair that tell it: features are matched wherever they are
// (ORB, E. Rublee et al., ICCV 2011), placed by the first's stereo depth, and the second's pose is
// found by them. The same on any number of threads. Throws StoppedError when progress says so.
std::vector<BodyStep> StepsOfImages(const Sequence& recording,
                                    const std::vector<std::pair<size_t, size_t>>& pairs,
                                    const Progress& progress = {});

}  // namespace slcmap
