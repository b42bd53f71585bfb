#include "mapping/surfaces/junctions.h"

#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/mapping/surfaces/made_planes.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using testing::AddFloor;
using testing::AddWall;

MapLine LineAt(const Vector3d& start, const Vector3d& end) {
  MapLine line;
  line.id = 7;
  line.segment = 2;
  line.axis = LineAxis::kX;
  line.world = 0;
  line.start_world = start;
  line.end_world = end;
  line.observations = 5;
  line.kind = LineKind::kEdge;
  return line;
}

MapResult MapOfCorner() {
  MapResult map;
  map.building = testing::WallAndFloor();
  testing::AddWall({0, 4}, {0.1, 1}, 0, &map.dense);
  testing::AddFloor({0, 4}, {0.1, 1}, 0, &map.dense);
  return map;
}

TEST(Junctions, AreEdgesThatNoImageShows) {
  MapResult map = MapOfCorner();
  map.building.planes[0].sigma_m = 0.02;  // the wall's
  map.lines = {LineAt({0, 0, 1.2}, {3, 0, 1.2})};
  map.line_evidence.covariances = {{7, 0}};
  AddJunctions({}, {}, &map);
  ASSERT_EQ(map.lines.size(), 2U);
  const MapLine& edge = map.lines.back();
  EXPECT_EQ(edge.id, 8);
  EXPECT_EQ(edge.kind, LineKind::kEdge);
  EXPECT_EQ(edge.observations, 0);
  EXPECT_EQ(edge.axis, LineAxis::kX);  // as the line along it has it
  EXPECT_EQ(edge.world, 0);
  EXPECT_NEAR((edge.end_world - edge.start_world).norm(), 4, 0.2);
  for (const Vector3d& p : {edge.start_world, edge.end_world}) {
    EXPECT_LT(std::hypot(p.y(), p.z()), 1e-9);
  }
  ASSERT_EQ(map.line_evidence.covariances.size(), 2U);
  const LineCovariance& known = map.line_evidence.covariances.back();
  EXPECT_EQ(known.line_id, 8);
  EXPECT_GT(known.start_m2(1, 1), 0.02 * 0.02);  // as the wall's plane is known, and more
  EXPECT_LT(known.start_m2(2, 2), 0.02 * 0.02);
  EXPECT_NEAR(known.start_m2(0, 0), 0, 1e-12);  // nothing is said along it
  EXPECT_NEAR(edge.sigma_m, std::sqrt(known.start_m2(1, 1)), 1e-9);
  EXPECT_EQ(edge.segment, 2);  // as the line's

  RemoveJunctions(&map);
  ASSERT_EQ(map.lines.size(), 1U);
  EXPECT_EQ(map.lines.front().id, 7);
  ASSERT_EQ(map.line_evidence.covariances.size(), 1U);
}

TEST(Junctions, HaveNoAxisThatNoLineHas) {
  MapResult map = MapOfCorner();
  AddJunctions({}, {}, &map);
  ASSERT_EQ(map.lines.size(), 1U);
  EXPECT_EQ(map.lines.front().id, 0);
  EXPECT_EQ(map.lines.front().axis, LineAxis::kNone);
  EXPECT_EQ(map.lines.front().world, -1);
}

TEST(Junctions, FillWhatLinesOfTheImagesLeave) {
  const MapResult map = MapOfCorner();
  const std::vector<MapLine> shown = {LineAt({1, 0.02, 0.02}, {2.5, 0.02, 0.02}),
                                      LineAt({0, 0.3, 0}, {4, 0.3, 0})};
  const auto edges = FindJunctionEdges(map.building, map.dense, shown, {});
  ASSERT_EQ(edges.size(), 2U);
  double length_m = 0;
  for (const JunctionEdge& edge : edges) length_m += (edge.end_world - edge.start_world).norm();
  EXPECT_NEAR(length_m, 2.5, 0.25);
}

TEST(Junctions, OfPlanesThatAreOneAreOne) {
  MapResult map = MapOfCorner();
  map.building.planes.push_back(map.building.planes.front());
  map.building.planes.back().offset_m += 0.01;
  EXPECT_EQ(FindJunctionEdges(map.building, map.dense, {}, {}).size(), 1U);
}

TEST(Junctions, OfSurfacesThatBendStayNearThem) {
  MapResult map;
  map.building = testing::WallAndFloor();
  testing::AddFloor({0, 4}, {0.1, 1}, 0, &map.dense);
  for (double x = 0; x < 4; x += 0.2)
    testing::AddWall({x, x + 0.2}, {0.1, 1}, 0.002 * x, &map.dense);
  const auto edges = FindJunctionEdges(map.building, map.dense, {}, {});
  ASSERT_EQ(edges.size(), 1U);
  for (const Vector3d& p : {edges[0].start_world, edges[0].end_world}) {
    EXPECT_NEAR(p.y(), 0.002 * p.x(), 0.004);
    EXPECT_NEAR(p.z(), 0, 1e-9);
  }
}

// Also not of a patch of both surfaces at one place, which is no edge.
TEST(Junctions, AreNotAddedWhereTheyAreOffOrNothingIsBuilt) {
  MapResult map = MapOfCorner();
  JunctionOptions off, wrong;
  off.add = false;
  AddJunctions(off, {}, &map);
  AddJunctions({}, Progress([](double) { return false; }), &map);
  EXPECT_TRUE(map.lines.empty());
  map.dense.clear();
  testing::AddWall({1, 1.05}, {0.1, 0.5}, 0, &map.dense);
  testing::AddFloor({1, 1.05}, {0.1, 0.5}, 0, &map.dense);
  AddJunctions({}, {}, &map);
  EXPECT_TRUE(map.lines.empty());
  map.building = {};
  AddJunctions({}, {}, &map);
  EXPECT_TRUE(map.lines.empty());
  wrong.reach_m = 0;
  EXPECT_THROW(wrong.Check(), ConfigError);
}

std::optional<PlaneJunction> JunctionOf(const Building& building,
                                        const std::vector<DensePoint>& cloud) {
  const std::vector<SurfacePoints> surfaces = PointsOfPlanes(building, cloud, {});
  EXPECT_EQ(surfaces.size(), 2U);
  return FindJunction(surfaces[0], surfaces[1], {});
}

TEST(PlaneJunction, IsWhereBothSurfacesAreMeasured) {
  const Building building = testing::WallAndFloor();
  std::vector<DensePoint> cloud;
  AddWall({0, 3}, {0.1, 1}, 0, &cloud);
  AddFloor({1, 4}, {0.1, 1}, 0, &cloud);
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  EXPECT_NEAR(std::abs(junction->direction_world.x()), 1, 1e-12);
  double from_m = 1e9, to_m = -1e9;
  for (const JunctionPlace& place : junction->places) {
    const Eigen::Vector3d p = junction->At(place.along_m, place.offset_m);
    EXPECT_LT(std::hypot(p.y(), p.z()), 1e-9);
    from_m = std::min(from_m, p.x());
    to_m = std::max(to_m, p.x());
  }
  EXPECT_NEAR(from_m, 1, 0.15);
  EXPECT_NEAR(to_m, 3, 0.15);
}

TEST(PlaneJunction, EndsAtADoorway) {
  Building building = testing::WallAndFloor();
  PlaneOpening& door = building.planes[0].openings.emplace_back();
  door.outline_world = {{1, 0, 0}, {2, 0, 0}, {2, 0, 2.1}, {1, 0, 2.1}};
  std::vector<DensePoint> cloud;
  AddWall({0, 1.1}, {0.1, 1}, 0, &cloud);
  AddWall({1.9, 4}, {0.1, 1}, 0, &cloud);
  AddFloor({0, 4}, {0.1, 1}, 0, &cloud);
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  double nearest_m = 1e9;
  for (const JunctionPlace& place : junction->places) {
    const double x_m = junction->At(place.along_m, place.offset_m).x();
    EXPECT_FALSE(x_m > 1 && x_m < 2) << x_m;
    nearest_m = std::min(nearest_m, std::abs(x_m - 1));
  }
  EXPECT_LT(nearest_m, 0.06);
}

TEST(PlaneJunction, OfTwoWallsIsNoneOfADoorBesideIt) {
  Building building = testing::WallAndFloor();
  building.planes[1] = testing::MakePlane(PlaneKind::kWall, Eigen::Vector3d::UnitX(),
                                          {{0, 0, 0}, {0, 3, 0}, {0, 3, 2.5}, {0, 0, 2.5}});
  PlaneOpening& door = building.planes[0].openings.emplace_back();
  door.outline_world = {{0.05, 0, 0}, {1, 0, 0}, {1, 0, 2.1}, {0.05, 0, 2.1}};
  std::vector<DensePoint> cloud;
  AddWall({0, 0.05}, {0.1, 2}, 0, &cloud);
  for (double y_m = 0.05; y_m < 1; y_m += 0.04) {
    for (double z_m = 0.1; z_m < 2; z_m += 0.04) {
      cloud.push_back({{0, y_m, z_m}, Eigen::Vector3d::UnitX(), 0.005, 100});
    }
  }
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  EXPECT_GT(junction->places.size(), 30u);
}

TEST(PlaneJunction, IsNoneWhereOneIsFarFromTheOtherOrParallel) {
  Building building = testing::WallAndFloor();
  EXPECT_FALSE(JunctionOf(building, {}));
  std::vector<DensePoint> far, behind;
  AddWall({0, 3}, {0.7, 2}, 0, &far);  // a wall that may end above the floor
  AddFloor({0, 3}, {0.1, 1}, 0, &far);
  EXPECT_FALSE(JunctionOf(building, far));
  AddWall({0, 3}, {0.1, 1}, 0, &behind);
  AddFloor({0, 3}, {-1, -0.1}, 0, &behind);  // of another room
  EXPECT_FALSE(JunctionOf(building, behind));
  building.planes[1] = building.planes[0];
  EXPECT_FALSE(JunctionOf(building, behind));
}

}  // namespace
}  // namespace slcmap
