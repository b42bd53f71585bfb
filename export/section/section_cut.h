// What the plane of a section cuts. Metres: x as the view says, y the height in world.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "export/plan/drawing.h"
#include "export/section/section_view.h"
#include "export/section/tall_wall.h"

namespace slcmap {

// A box that is cut, and which of its sides nobody saw: left, right, bottom, top.
struct CutBox {
  Eigen::AlignedBox2d box;
  bool is_assumed = false;
  std::array<bool, 4> assumed_sides = {};
};

// A wall from side to side, as if it had no openings.
struct CutWall {
  const PlanWall* wall = nullptr;
  CutBox cut;
};

// An opening that is cut, as wide as its wall is thick there, or seen beyond the cut.
struct SectionOpening {
  const PlanOpening* opening = nullptr;
  Eigen::AlignedBox2d box;
  bool is_cut = false;
};

// A room from wall to wall.
struct CutRoom {
  const Room* room = nullptr;
  double from_m = 0, to_m = 0;
};

struct SectionCut {
  std::vector<CutBox> boxes;
  std::vector<CutWall> walls;
  std::vector<SectionOpening> openings;
  std::vector<CutRoom> rooms;
};

// Walls without their openings, floors and ceilings with the slabs that are assumed there, also
// under and over walls.
SectionCut CutOf(const Building& building, const std::vector<TallWall>& walls,
                 const SectionView& view);

// Areas, and their borders.
Drawing DrawCut(const std::vector<CutBox>& boxes);

}  // namespace slcmap
