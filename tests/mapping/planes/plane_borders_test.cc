#include <gtest/gtest.h>

#include "mapping/surfaces/bounded_plane.h"
#include "tests/mapping/planes/floor_grid.h"

namespace slcmap {
namespace {

// Upright from (1, 0, h) to (1, 2, h) on the floor.
MapLine LineAt(double height_m) {
  MapLine line;
  line.start_world = {1, 0, height_m};
  line.end_world = {1, 2, height_m};
  line.kind = LineKind::kEdge;
  return line;
}

TEST(PlaneBorders, PartWhatIsOnDifferentSides) {
  const PlaneBorders borders(FloorGrid(), {LineAt(0.02)}, 0.05);
  EXPECT_TRUE(borders.Part({8, 5}, {12, 7}));
  EXPECT_FALSE(borders.Part({8, 5}, {9.5, 7}));
  EXPECT_FALSE(borders.Part({8, 25}, {12, 25}));  // beyond its end
}

TEST(PlaneBorders, AreNeitherMarksNorFarOffThePlane) {
  MapLine mark = LineAt(0);
  mark.kind = LineKind::kMark;
  EXPECT_FALSE(PlaneBorders(FloorGrid(), {mark, LineAt(0.1)}, 0.05).Part({8, 5}, {12, 7}));
}

}  // namespace
}  // namespace slcmap
