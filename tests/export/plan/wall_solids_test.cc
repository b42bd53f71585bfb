#include <gtest/gtest.h>

#include "export/scene/building_solids.h"
#include "tests/testing/made_building.h"

namespace slcmap {
namespace {

double TotalArea(const std::vector<Polygon>& areas) {
  double total = 0;
  for (const Polygon& area : areas) total += Area(area);
  return total;
}

// 4 m by 3 m within, 4.4 m by 3.4 m outside, without a door of 0.9 m and a window of 1.2 m.
constexpr double kWalls_m2 = 4.4 * 3.4 - 4 * 3 - 0.2 * (0.9 + 1.2);

TEST(WallSolidsTest, CornersAreClosedAndOpeningsCut) {
  for (const double turn_rad : {0.0, 0.2, -1.3}) {
    const auto areas = WallAreas(WallSolids(testing::MakeBuilding(1, turn_rad), 0));
    EXPECT_NEAR(TotalArea(areas), kWalls_m2, 1e-4) << turn_rad;
    EXPECT_EQ(areas.size(), 2u);  // the door and the window part the ring of walls
  }
}

TEST(WallSolidsTest, ThePlanIsInTheFrameOfTheMainHeading) {
  Building building = testing::MakeBuilding(1, 0.3);
  building.T_map_world.rotation = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitZ());
  building.T_map_world.translation = {10, 20, 0};
  EXPECT_LT((WallSolids(building, 0)[0].start - Eigen::Vector2d(14, 20)).norm(), 1e-9);
  EXPECT_LT((RoomInPlan(building, building.rooms[0]).outline[2] - Eigen::Vector2d(14, 23)).norm(),
            1e-9);
}

TEST(WallSolidsTest, OnlyTheBackOfAWallThatWasSeenFromOneSideIsAssumed) {
  double assumed_m = 0, measured_m = 0;
  for (const WallEdge& edge : WallEdges(WallSolids(testing::MakeBuilding(), 0))) {
    (edge.assumed ? assumed_m : measured_m) += (edge.end - edge.start).norm();
  }
  EXPECT_NEAR(assumed_m, 3.4, 1e-4);  // from outer corner to outer corner
  // Within and outside, and the jambs of the openings.
  EXPECT_NEAR(measured_m, 2 * (4 + 3) + 2 * 4.4 + 3.4 - 2 * (0.9 + 1.2) + 4 * 0.2, 1e-4);
}

TEST(WallSolidsTest, WallsThatOverlapAreOneArea) {
  Building building = testing::MakeBuilding();
  building.walls[1].openings.clear();
  const double once_m2 = TotalArea(WallAreas(WallSolids(building, 0)));
  building.walls.push_back(building.walls[1]);
  EXPECT_NEAR(TotalArea(WallAreas(WallSolids(building, 0))), once_m2, 1e-9);
}

TEST(WallSolidsTest, WallsThatTurnBackHaveTheirCornersWithin) {
  Building building;
  building.storeys = {{0, 0, {}}};
  PlanWall along, away;  // around the outside of a column's corner
  along.start = {0, 0};
  along.end = {2, 0};
  away.start = {2, 0};
  away.end = {2, 2};
  along.thickness_m = away.thickness_m = 0.2;
  building.walls = {along, away};
  EXPECT_NEAR(TotalArea(WallAreas(WallSolids(building, 0))), 0.2 * 2 + 0.2 * 1.8, 1e-6);
}

TEST(WallSolidsTest, WallsWithoutALengthAndOpeningsBeyondTheEndDoNoHarm) {
  Building building = testing::MakeBuilding();
  building.walls[0].end = building.walls[0].start;
  building.walls[1].openings = {{OpeningKind::kPassage, false, 1, 99, 0, 2}};
  building.walls[2].openings = {{OpeningKind::kPassage, false, 50, 99, 0, 2}};
  EXPECT_EQ(WallSolids(building, 0).size(), 3u);
  EXPECT_GT(TotalArea(WallAreas(WallSolids(building, 0))), 0.5);
}

}  // namespace
}  // namespace slcmap
