// What buildings are made from.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/map_line.h"

namespace slcmap {

// A point on a surface, of a dense cloud or a landmark. Metres, in world.
struct SurfacePoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();  // to the cameras; zero: unknown
  double sigma_m = 0.01;
};

// What one view saw: rays from its centre to points, each with the standard deviation of its
// distance. Floats, as there are many.
struct Sights {
  Eigen::Vector3d p_world_camera = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> p_world;
  std::vector<float> sigma_m;  // as many
};

struct BuildingInput {
  std::vector<SurfacePoint> points;
  std::vector<MapLine> lines;
  std::vector<Sights> sights;
  std::vector<Eigen::Vector3d> trajectory_world;  // places of the rig, in their order
};

}  // namespace slcmap
