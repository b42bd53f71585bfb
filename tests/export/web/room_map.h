// A map of a room whose numbers are known, as large as one likes.
#pragma once

#include "mapping/map/map.h"

namespace slcmap::testing {

struct RoomMapSize {
  int lines = 12;  // the twelve edges of the room, then others at random places in it
  int dense_points = 400;
  int planes = 6;  // floor, ceiling and four walls, then others
};

// A room from (100, 200, 0) to (104, 205, 2.6) in the world, whose floor and ceiling are planes 0
// and 1; walls 2 and 3 are at the lower and upper x, 4 and 5 at the lower and upper y. Plane 3 has
// a door 0.9 m wide and 2 m high. The room goes around a pillar from (103.2, 200.5) to (103.7,
// 201). Sigma is 3 mm of lines and 4 mm of planes. Line 10 goes from (100, 200, 0) along x, line 11
// from (100, 205, 0): the lower edges along x of the room. One mark, one outline, two worlds, four
// landmarks in the middle at z = 1, a walk through the middle along x with five keyframes, and one
// occupied voxel. What is at random places is always at the same.
MapResult MakeRoomMap(const RoomMapSize& size = {});

}  // namespace slcmap::testing
