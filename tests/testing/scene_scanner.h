// What a perfect rig would measure of a simulated scene, with made noise: quick to have, unlike
// images.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/io/true_building.h"
#include "data/simulator/scene/scene.h"
#include "mapping/map/building.h"

namespace slcmap::testing {

struct ScanOptions {
  double noise_m = 0.01;          // of a distance
  double normal_noise_rad = 0.1;  // of a normal, in each of two directions
  double line_noise_m = 0.003;    // of a line across it
  double voxel_m = 0.05;          // in which points that look the same way are fused
  int rays = 1500;                // from each place, all around
  double range_m = 8;
  Eigen::Vector3d drift_m = Eigen::Vector3d::Zero();  // of what the second half of places measures
  bool with_lines = true;
};

// Materials without contrast, and lamps, give no points: stereo sees nothing on them.
BuildingInput Scan(const Scene& scene, const std::vector<Eigen::Vector3d>& places,
                   const ScanOptions& options = {});

// What is true, as seen from the places.
TrueBuilding SeenFrom(const Scene& scene, const std::vector<Eigen::Vector3d>& places,
                      const ScanOptions& options = {});

// From waypoint to waypoint.
std::vector<Eigen::Vector3d> PlacesAlong(const std::vector<Eigen::Vector3d>& waypoints,
                                         double step_m = 0.4);

// A scene from YAML text.
Scene SceneFromText(const std::string& yaml);

// A room of walls along `corners` with two boxes, its floor of `size`, both as YAML.
Scene RoomWithBoxes(const std::string& size, const std::string& corners);

}  // namespace slcmap::testing
