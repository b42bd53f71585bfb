// Where the points are that images at known poses show.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "data/core/types.h"
#include "mapping/control/control_points.h"

namespace slcmap::inline mapping {

// The cameras of sightings, whose pixels are those of raw images: `raw` is how they are, with what
// was found of them; only how its cameras are turned against those of `rectified` counts, which
// poses are of.
struct SightingCameras {
  Rig raw, rectified;

  // On the plane z = 1 of the rectified camera; nothing where it does not see that way.
  std::optional<Eigen::Vector2d> OnPlane(const Sighting& sighting) const;
};

// The raw cameras as a map has found them: lenses and the turn between them from its calibration,
// where it has one, in the place where the given ones are.
Rig CamerasOfMap(const Rig& given, const std::optional<Rig>& calibrated);

struct PlacedPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double sigma_m = 0;  // of a coordinate, in the direction in which it is known least
  int views = 0;       // that agree on it
};

// By name, those that two images or more place to 10 cm; sightings that do not fit the others, as
// of a tag that was read wrongly, are left out. T_world_imu: by stamp.
std::map<std::string, PlacedPoint> Triangulate(
    const std::vector<Sighting>& sightings, const SightingCameras& cameras,
    const std::unordered_map<int64_t, RigidTransform>& T_world_imu);

}  // namespace slcmap::mapping
