// Openings of a face, from what was seen through it.
#pragma once

#include <vector>

#include "mapping/building/free_space.h"
#include "mapping/building/storeys.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

inline constexpr double kLintel_m = 0.25;  // a door has at least this above it

// A rectangle of a face's plane: metres along the face and heights in world.
struct FaceOpening {
  OpeningKind kind = OpeningKind::kPassage;
  bool walked = false;
  double from_m = 0, to_m = 0, low_m = 0, high_m = 0;

  // Of its wall, which is as high: nothing is over it.
  bool IsGap(double top_m) const {
    return kind == OpeningKind::kPassage && high_m >= top_m - kLintel_m;
  }
};

// Regions of cells that were passed, with something measured at either side, large enough; what was
// not seen is none, but for what is over a door up to its usual height, and beside it up to its
// wall where that is near. Edges go to the nearest upright line, or line along the face, near the
// plane within max(2 sigma, 5 cm). Those that begin near the floor are doors, or passages where
// nothing is above them or they are wide; the others are windows, which bars may divide.
std::vector<FaceOpening> FindOpenings(const Face& face, const FaceGrid& grid, const Level& level,
                                      const BuildingInput& input);

}  // namespace slcmap::mapping
