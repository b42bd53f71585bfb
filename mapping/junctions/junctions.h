// Edges of a building that images hardly show, as those between walls and a ceiling of one paint:
// where its planes meet.
#pragma once

#include <vector>

#include "data/progress.h"
#include "mapping/junctions/plane_junction.h"
#include "mapping/map.h"

namespace slcmap {

// A straight piece of a junction.
struct JunctionEdge {
  const BuildingPlane* planes[2] = {nullptr, nullptr};
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
};

// The edges at which walls, floors and ceilings meet, where none of `lines` is; those with most
// points first, of several that are one edge the first alone. The planes are those of `building`.
// Once progress says so, there are none.
std::vector<JunctionEdge> FindJunctionEdges(const Building& building,
                                            const std::vector<DensePoint>& cloud,
                                            const std::vector<MapLine>& lines,
                                            const JunctionOptions& options,
                                            const Progress& progress = {});

// Adds them to a map's lines, as edges that no image shows (observations 0), of the segment that
// most of its lines are of.
void AddJunctions(const JunctionOptions& options, const Progress& progress, MapResult* map);

// Takes them out again.
void RemoveJunctions(MapResult* map);

}  // namespace slcmap
