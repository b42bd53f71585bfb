// See neighbour_directions.h.
#pragma once

namespace slcmap {

// A building bends and leans as a whole, and what is fitted into it stands askew as a whole: how
// far lines of one axis are off it is alike where they are near each other.
struct NeighbourOptions {
  // Of the variance of lines about their axis: what all of them share, and what those near each
  // other do, less by exp(-distance / reach_m). The rest is a line's own.
  double building_share = 0.3, shared_share = 0.4;
  double reach_m = 3;
  int max_neighbours = 40;  // of a line, the nearest ones
};

}  // namespace slcmap
