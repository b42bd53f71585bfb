// The lines of walls in the plan, each in parts: covered by a wall, gaps of a door's width, open.
#pragma once

#include <optional>
#include <vector>

#include "mapping/building/rooms.h"

namespace slcmap {

inline constexpr double kPlanGrid_m = 5e-4;  // of the points of a plan

struct WallPart {
  double from_m = 0, to_m = 0;  // along the face
  double share = 0;             // that is covered, 0 to 1
  bool is_narrow = false;       // a gap that parts rooms all the same
};

// One with its ends in the plan.
struct PlacedPart {
  WallPart part;
  Eigen::Vector2d from, to;
};

struct WallLine {
  const WallFace* wall = nullptr;
  std::vector<WallPart> parts;  // one after the other, the first and last beyond the face

  PlanPoints Chain() const;
};

// Lines extended at both ends beyond the first wall that goes across, or by options.extension_m.
std::vector<WallLine> LinesOf(const std::vector<WallFace>& walls, const BuildingOptions& options);

// The part of any of the lines that covers a piece of one most; nothing where it is on none.
std::optional<PlacedPart> PartAt(const std::vector<WallLine>& lines, const Eigen::Vector2d& a,
                                 const Eigen::Vector2d& b);

// Where two faces cross, as metres along each; nothing where they are nearly parallel.
std::optional<std::pair<double, double>> Crossing(const Face& a, const Face& b);

}  // namespace slcmap
