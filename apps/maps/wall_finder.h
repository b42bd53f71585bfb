// Walls of a cloud by another system: connected upright surfaces, however they bend.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/maps/straightedge.h"
#include "apps/maps/surface_map.h"

namespace slcmap::inline evaluation {

// One face, with axes of its own: along (level), upwards, and its normal.
struct FoundFace {
  Eigen::Vector3d middle, along, upwards, normal;
  double length_m = 0, height_m = 0;
  double noise_m = 0;  // standard deviation of a point
  // Points from the plane that fits best; what stands before it is left out. A sample counts by the
  // area that it stands for.
  std::vector<StraightSample> samples;
  std::vector<int32_t> points;  // by sample: of the map
};

// Deterministic; the longest first. `up`: unit.
std::vector<FoundFace> FindFaces(const SurfaceMap& map, const Eigen::Vector3d& up);

}  // namespace slcmap::evaluation
