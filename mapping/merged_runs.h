// The runs of a merged map, as map.json holds them. Include in .cc files only.
#pragma once

#include <string>
#include <vector>

#include "data/json_file.h"
#include "mapping/map.h"

namespace slcmap {

Json MergedJson(const std::vector<MergedRun>& runs);

// Throws DataError, naming the path and the run, for less than two runs, one that is there twice,
// a first one that is not where it was or not that of the map's source, and values that cannot be.
std::vector<MergedRun> ParseMerged(const std::string& path, const Json& json,
                                   const MapSource& source);

// How a run's world is turned in the map's, about z: yaw_rad of an object, and back.
double YawOfWorld(const RigidTransform& T_world_run);
RigidTransform ParseTurn(const std::string& place, const Json& json);

// world_offset_m of an object, and back: zero where it is missing, as in maps of earlier versions.
Json OffsetJson(const Eigen::Vector3d& world_offset_m);
Eigen::Vector3d ParseOffset(const std::string& place, const Json& json);

// Throws DataError, naming the path, where it is known from when to when each run has poses and the
// map has one besides.
void CheckPosesOfRuns(const std::string& path, const MapResult& map);

}  // namespace slcmap
