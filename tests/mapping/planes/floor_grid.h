// A plane for tests.
#pragma once

#include "mapping/surfaces/bounded_plane.h"

namespace slcmap {

// The plane z = 0 of 4 m by 4 m, seen from above, in cells of 10 cm.
inline PlaneGrid FloorGrid() {
  PlaneGrid grid;
  grid.cell_m = 0.1;
  grid.columns = grid.rows = 40;
  return grid;
}

}  // namespace slcmap
