// How well an occupancy map tells occupied, free and unknown space apart, by true rays.
#pragma once

#include <vector>

#include "apps/evaluation/alignment.h"
#include "apps/evaluation/seen_surfaces.h"
#include "data/progress.h"
#include "mapping/occupancy_map.h"

namespace slcmap {

// Shares of nothing are kNoFigure.
struct OccupancyMetrics {
  int64_t rays = 0;
  double ends_occupied = 0;         // share of rays whose end cell is occupied
  double ends_occupied_nearby = 0;  // or one of the 26 cells around it
  // Of samples along the rays, a cell apart and two cells off their ends: share that is known, and
  // share of the known ones that is free.
  double passages_known = 0, passages_free = 0;
  // Of samples from two cells to half a metre behind the ends that surfaces hide from all views:
  // their number, and the share that is called free.
  int64_t behind = 0;
  double behind_called_free = 0;
};

// Looks at one ray in twenty. `alignment` lays the map's world over that of the views. Throws
// StoppedError when progress says so.
OccupancyMetrics EvaluateOccupancy(const TriangleTree& surfaces,
                                   const std::vector<ReferenceView>& views,
                                   const OccupancyMap& occupancy, const Alignment& alignment,
                                   const Progress& progress = {});

}  // namespace slcmap
