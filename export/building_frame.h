// The frame of exports: along the building, the same in all formats.
#pragma once

#include "data/progress.h"
#include "mapping/map.h"

namespace slcmap {

// From the map's world to the frame of exports: a turn about z that lays the main heading of the
// walls (Building::T_map_world) along x or y, whichever is nearer, by at most 45 degrees.
// None for maps that are far away: they lie in a frame that others share, whose axes they keep.
RigidTransform FrameOfExports(const MapResult& map);

// Whether it is there already.
bool IsInFrameOfExports(const Building& building);

// The map in the frame of exports, in which Building::T_map_world is none; MapSource says how its
// runs are turned there. Occupancy is sampled anew: a voxel is what the map has at its centre.
// Throws StoppedError when progress says so.
MapResult InFrameOfExports(const MapResult& map, const Progress& progress);

}  // namespace slcmap
