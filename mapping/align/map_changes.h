// What changed in a building between two maps of it, by surfaces of the one in what the other saw
// to be free.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/align/map_agreement.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

// A thing, or a part of a wall, that is in one map alone although the other one looked there.
struct MapChange {
  bool is_new = false;   // else it is gone
  bool is_wall = false;  // a large upright plane
  double area_m2 = 0;    // of its surfaces
  // A box around them, along the axes of the world of the earlier map.
  Eigen::Vector3d least_world = Eigen::Vector3d::Zero(), most_world = Eigen::Vector3d::Zero();
  std::vector<SurfaceSample> surfaces;  // in that world
};

// Those of 0.4 m2 and more; the largest first. Deterministic.
std::vector<MapChange> FindChanges(const ComparedMap& earlier, const ComparedMap& later,
                                   const RigidTransform& T_earlier_later);

// Takes what is gone out of the points and lines of the earlier map.
void RemoveGone(const std::vector<MapChange>& changes, MapResult* earlier);

}  // namespace slcmap::mapping
