// What lies between the two faces of a wall.
#pragma once

#include <optional>
#include <vector>

#include "mapping/building/building_options.h"
#include "mapping/building/rooms.h"

namespace slcmap {

// A face behind another, as the other side of the same wall.
struct WallBody {
  double from_m = 0, to_m = 0;  // along the front, where there are both
  double thickness_m = 0;
};

// Nothing unless the faces look away from each other, between the least and the largest thickness
// apart and beside each other for half of the shorter one.
std::optional<WallBody> BodyBetween(const Face& front, const Face& back,
                                    const BuildingOptions& options);

// Whether a place is between two faces of one wall.
bool IsInWall(const std::vector<WallFace>& walls, const Eigen::Vector2d& p,
              const BuildingOptions& options);

}  // namespace slcmap
