// Sections and elevations: from where they are seen, what they cut of a building, and the drawing
// of that with its dimensions, from which sheets and CAD files are made.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "export/plan/drawing.h"
#include "export/plan/sheet.h"
#include "export/scene/building_solids.h"
#include "export/scene/options.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// What an upright plane cuts of a building, and what is beyond it. Metres in the plan's frame.
struct SectionView {
  std::string name;                                  // of its files: "section_1"
  std::string title;                                 // "Section 1-1"
  std::string place;                                 // "x = 3.20, towards larger x"
  std::string mark;                                  // "1", as plans show it; "" of elevations
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // on the plane, where the drawing has x = 0
  Eigen::Vector2d right = Eigen::Vector2d::UnitX();  // the drawing's x, of length 1
  // What is drawn, along that, and how far beyond the plane.
  double from_m = -std::numeric_limits<double>::infinity();
  double to_m = std::numeric_limits<double>::infinity();
  double depth_m = std::numeric_limits<double>::infinity();
  std::optional<int64_t> storey;  // that alone

  bool Shows(int64_t of_storey) const { return !storey || *storey == of_storey; }
  // The direction in which one looks: to the left of `right`.
  Eigen::Vector2d Ahead() const { return {-right.y(), right.x()}; }
  // Along the drawing's x, and beyond the plane.
  Eigen::Vector2d At(const Eigen::Vector2d& point) const {
    return {(point - origin).dot(right), (point - origin).dot(Ahead())};
  }
};

// Of an option --section: "x=3.2" or "y=1" with ",back" to look the other way, or "1,2:8,2", whose
// first point is to the left of the drawing; `number` counts from 1. Throws ConfigError.
SectionView ParseSection(const std::string& text, int number);

// Throws ConfigError for sections and elevations that cannot be.
void CheckSections(const PlanOptions& options);

// Those of the options: the sections, then elevations, as the sides of the building, and of rooms,
// are seen. Throws ConfigError, also for a building without walls and rooms, and sections that cut
// none.
std::vector<SectionView> SectionViews(const Building& building, const PlanOptions& options);

// What the plane of a section cuts, and what hides what beyond it. Metres: x as the view says, y
// the height in world.

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

// A section or an elevation with its dimensions, from which sheets and CAD files are drawn.

// Metres: x as the view says, y the height in world.
struct SectionDrawing {
  SectionView view;
  SheetFormat format;
  Eigen::AlignedBox2d extent;
  Drawing shape;                 // areas and paths
  std::vector<DrawnText> texts;  // rooms, sizes of openings, heights over the lowest floor
  std::vector<DrawnPath> marks;  // of the heights
  std::vector<Dimension> dimensions;
};

// The sections and elevations that options ask for, each at the scale that ChooseFormat finds for
// it. Throws what SectionViews and ChooseFormat do.
std::vector<SectionDrawing> MakeSections(const MapResult& map, const PlanOptions& options);

}  // namespace slcmap::exporting
