// What the plane of a section cuts, and what hides what beyond it. Metres: x as the view says, y
// the height in world.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/section_view.h"
#include "export/scene/building_solids.h"

namespace slcmap::inline exporting {

struct TallWall {
  WallSolid solid;
  WallHeight height;

  double Top_m() const { return height.floor_m + height.height_m; }
  // Of an opening: metres along the wall, and heights in world.
  std::optional<Eigen::AlignedBox2d> Hole(const PlanOpening& opening) const {
    auto hole = ComputeHole(opening, *solid.wall, height);
    if (hole) hole->translate(Eigen::Vector2d(0, height.floor_m));
    return hole;
  }
};

// Those of the storeys that a view shows; walls whose top was not seen are 2.5 m high, as in IFC.
inline std::vector<TallWall> TallWalls(const Building& building, const SectionView& view) {
  std::vector<TallWall> walls;
  for (const Storey& storey : building.storeys) {
    if (!view.Shows(storey.id)) continue;
    for (const WallSolid& solid : WallSolids(building, storey.id)) {
      const WallHeight height = HeightOfWall(*solid.wall, building);
      if (IsSolid(*solid.wall, height)) walls.push_back({solid, height});
    }
  }
  return walls;
}

// What the plane of a section cuts. Metres: x as the view says, y the height in world.

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
SectionCut MakeCut(const Building& building, const std::vector<TallWall>& walls,
                   const SectionView& view);

// Areas, and their borders.
Drawing DrawCut(const std::vector<CutBox>& boxes);

// Which lines of a view are hidden by what is before them.

// A line of a view: x to the right, y up, z away from the eye. Metres.
struct ViewedLine {
  Pen pen = Pen::kBeyond;
  Eigen::Vector3d start, end;
  double before_m = 0;  // what is nearer to it than that does not hide it
};

// An upright rectangle, at those depths at its left and right.
struct Screen {
  Eigen::AlignedBox2d box;
  double left_m = 0, right_m = 0;
};

// Whether a screen lies before a point, by more than that.
bool IsHidden(const std::vector<Screen>& screens, const Eigen::Vector3d& point, double before_m);

// What is seen of the lines, from a depth of 0 on, within a window; each part once: level and
// upright ones of a pen that overlap are one.
std::vector<DrawnPath> SeenParts(const std::vector<ViewedLine>& lines,
                                 const std::vector<Screen>& screens,
                                 const Eigen::AlignedBox3d& window);

}  // namespace slcmap::exporting
