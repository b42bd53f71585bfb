// What a section or an elevation shows: what is cut, and what is seen beyond. Metres: x as the view
// says, y the height in world.
#pragma once

#include <Eigen/Geometry>

#include "export/plan/drawing.h"
#include "export/section/section_cut.h"
#include "export/section/section_view.h"
#include "mapping/map.h"

namespace slcmap {

struct SectionShape {
  Drawing drawing;             // areas of what is cut, paths of its borders and of what is beyond
  Eigen::AlignedBox2d extent;  // of walls, floors and ceilings; empty where there is nothing
  SectionCut cut;              // its openings are also those that are seen beyond
};

// Walls beyond the cut with their openings, and the lines of the map there, as far as other walls
// do not hide them.
SectionShape ShapeOfSection(const MapResult& map, const SectionView& view);

}  // namespace slcmap
