// Furnished floors with what would be mapped of them: walks through all rooms, walls of which
// half is blank, furniture before walls, pictures beside doors.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/io/true_building.h"
#include "data/simulator/scene/scene.h"
#include "mapping/map/building.h"

namespace slcmap::testing {

struct FurnishedFloor {
  std::string yaml;                     // a scene
  std::vector<Eigen::Vector3d> places;  // of a walk through it
};

// Kinds to make a method by, and kinds that are kept out of it.
inline const std::vector<std::string> kFloorsToMakeBy = {"offices", "hall", "openplan"};
inline const std::vector<std::string> kFloorsKeptOut = {"wing", "widening", "apartment"};

// Floors of one kind and another seed have other measures, doors and furniture.
FurnishedFloor MakeFurnishedFloor(const std::string& kind, int seed);

// As real maps have them: stereo that looks ahead, and sees nothing on blank parts of walls.
struct MappedFloor {
  BuildingInput input;
  TrueBuilding truth;
};
MappedFloor MapFloor(const Scene& scene, const std::vector<Eigen::Vector3d>& places);

}  // namespace slcmap::testing
