#include "mapping/surfaces/bounded_plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "mapping/surfaces/plane_filling.h"
#include "mapping/surfaces/plane_views.h"
#include "tests/mapping/surfaces/made_planes.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

double InsideArea(const BoundedPlane& plane) {
  return std::accumulate(plane.inside.begin(), plane.inside.end(), 0.0) * plane.grid.cell_m *
         plane.grid.cell_m;
}

// A room of 4 m x 4 m around a pillar.
Building RoomAroundPillar() {
  Building building;
  Room room;
  room.id = 3;
  room.polygon.outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  room.polygon.holes = {{{1, 1}, {1, 3}, {3, 3}, {3, 1}}};
  building.rooms = {room};
  for (const bool is_floor : {true, false}) {
    BuildingPlane plane;
    plane.kind = is_floor ? PlaneKind::kFloor : PlaneKind::kCeiling;
    plane.normal = Vector3d(0, 0, is_floor ? 1 : -1);
    plane.offset_m = is_floor ? 0.2 : -2.7;
    plane.room_ids = {3};
    for (const auto& p : room.polygon.outline) {
      plane.outline_world.emplace_back(p.x(), p.y(), is_floor ? 0.2 : 2.7);
    }
    building.planes.push_back(plane);
  }
  return building;
}

TEST(BoundedPlanes, LeaveOutWhatRoomsRunAround) {
  const std::vector<BoundedPlane> planes = BoundedPlanes(RoomAroundPillar(), {});
  ASSERT_EQ(planes.size(), 2);
  for (const BoundedPlane& plane : planes) {
    EXPECT_NEAR(InsideArea(plane), 16 - 4, 0.1);
    EXPECT_EQ(plane.reach_m, 4);
  }
  EXPECT_NEAR(planes[1].grid.At(3, 7).z(), 2.7, 1e-12);
}

TEST(BoundedPlanes, AreNotMadeOfFurniture) {
  Building building = testing::WallWithDoor(0.004);
  building.planes[0].kind = PlaneKind::kOther;
  EXPECT_TRUE(BoundedPlanes(building, {}).empty());
}

TEST(PlaneBorders, AreEdgesOfThePlaneThatPartWhatIsOnDifferentSides) {
  MapLine edge, mark, off;
  edge.start_world = {1, 0, 0.02};
  edge.end_world = {1, 2, 0.02};
  edge.kind = LineKind::kEdge;
  mark = off = edge;
  mark.kind = LineKind::kMark;
  off.start_world.z() = off.end_world.z() = 0.1;
  const PlaneBorders borders(testing::FloorGrid(), {edge}, 0.05);
  EXPECT_TRUE(borders.Part({8, 5}, {12, 7}));
  EXPECT_FALSE(borders.Part({8, 5}, {9.5, 7}));
  EXPECT_FALSE(borders.Part({8, 25}, {12, 25}));  // beyond its end
  EXPECT_FALSE(PlaneBorders(testing::FloorGrid(), {mark, off}, 0.05).Part({8, 5}, {12, 7}));
}

constexpr double kWallSigma_m = 0.005;

DensePoint PointAt(const Vector3d& p, double sigma_m) {
  return {p, -Vector3d::UnitY(), sigma_m, 100};
}

// Where the point is then.
DensePoint Drawn(const DensePoint& point, const PlaneOptions& options = {},
                 const Building& building = testing::WallWithDoor(kWallSigma_m)) {
  std::vector<DensePoint> dense = {point};
  SnapToPlanes(building, options, &dense);
  EXPECT_EQ(dense.size(), 1u);
  return dense.front();
}

TEST(SnapToPlanes, PointsMoveAsFarAsTheyAreUncertain) {
  const double surface_m2 = 0.005 * 0.005 + 0.01 * 0.01, stereo_m2 = 0.04 * 0.04;
  const DensePoint uncertain = Drawn(PointAt({3, 2.94, 1}, 0.04));
  EXPECT_NEAR(3 - uncertain.p_world.y(), 0.06 * surface_m2 / (surface_m2 + stereo_m2), 1e-9);
  EXPECT_NEAR(uncertain.sigma_m, std::sqrt(surface_m2 * stereo_m2 / (surface_m2 + stereo_m2)),
              1e-9);
  EXPECT_EQ(uncertain.p_world.x(), 3);
  EXPECT_NEAR(Drawn(PointAt({3, 2.98, 1}, 0.001)).p_world.y(), 2.98, 2e-4);
}

TEST(SnapToPlanes, WhatIsNotOnThePlaneStays) {
  const auto stays = [](const DensePoint& point, const PlaneOptions& options = {},
                        const Building& building = testing::WallWithDoor(kWallSigma_m)) {
    return Drawn(point, options, building).p_world == point.p_world;
  };
  const DensePoint on_wall = PointAt({3, 2.94, 1}, 0.04);
  EXPECT_FALSE(stays(on_wall));
  EXPECT_TRUE(stays(PointAt({1.5, 2.94, 1}, 0.04))) << "in the door";
  EXPECT_TRUE(stays(PointAt({5, 2.94, 1}, 0.04))) << "beside the wall";
  EXPECT_TRUE(stays(PointAt({3, 2.8, 1}, 0.04))) << "before it";
  DensePoint turned = on_wall;
  turned.normal_world = Vector3d::UnitX();
  EXPECT_TRUE(stays(turned)) << "a cupboard's side";
  PlaneOptions none;
  none.draw_sigmas = 0;
  EXPECT_TRUE(stays(on_wall, none));
  Building unseen = testing::WallWithDoor(kWallSigma_m);
  unseen.planes[0].inferred = true;
  EXPECT_TRUE(stays(on_wall, {}, unseen));
}

TEST(SnapToPlanes, OfSeveralThatComeToOnePlaceTheBestStays) {
  std::vector<DensePoint> dense = {PointAt({3, 2.92, 1}, 0.05), PointAt({3, 3.001, 1}, 0.004),
                                   PointAt({3, 3.08, 1}, 0.05), PointAt({3.5, 2.92, 1}, 0.05)};
  SnapToPlanes(testing::WallWithDoor(kWallSigma_m), {}, &dense);
  ASSERT_EQ(dense.size(), 2u);
  EXPECT_NEAR(dense[0].p_world.y(), 3.001, 1e-3);
  EXPECT_EQ(dense[1].p_world.x(), 3.5);
}

// Whether a place of the plan is one of the plane's cells that may be filled.
bool Holds(const BoundedPlane& plane, double x, double y) {
  const Vector3d p(x, y, 0);
  const int column = plane.grid.FindColumn(p), row = plane.grid.FindRow(p);
  return plane.grid.Contains(column, row) && plane.inside(row, column) != 0;
}

// A storey with a room of 2 by 2 m, and rays from its middle through the door that it has to x = 6.
struct StoreyScene {
  Building building;
  std::vector<ViewRays> rays;

  StoreyScene() {
    building.storeys = {{0, 0.0, 2.5}};
    Room room;
    room.polygon.outline = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
    building.rooms = {room};
    ViewRays view;
    view.p_world_camera = {1, 1, 1.5};
    for (int i = -20; i <= 20; ++i) {
      view.p_world.emplace_back(6, 1 + 0.05F * static_cast<float>(i), 1.2F);
      view.sigma_m.push_back(0.02F);
    }
    rays.assign(5, view);
  }
};

TEST(StoreyPlanes, LieWhereRaysWentBeyondTheRooms) {
  StoreyScene scene;
  const std::vector<BoundedPlane> planes = StoreyPlanes(scene.building, scene.rays, {});
  ASSERT_EQ(planes.size(), 2u);
  for (const BoundedPlane& plane : planes) {
    EXPECT_TRUE(Holds(plane, 4, 1));
    EXPECT_TRUE(Holds(plane, 5.5, 1.5));
    EXPECT_FALSE(Holds(plane, 1, 1)) << "in the room";
    EXPECT_FALSE(Holds(plane, 2.2, 1)) << "in its wall";
    EXPECT_FALSE(Holds(plane, 4, 1.9)) << "no ray went there";
    EXPECT_FALSE(Holds(plane, 5.97, 1)) << "the rays' ends are something";
    EXPECT_FALSE(plane.is_measured);
    EXPECT_EQ(plane.reach_m, 1.5);
  }
  EXPECT_NEAR(planes[0].grid.At(0, 0).z(), 0, 1e-12);
  EXPECT_NEAR(planes[1].grid.At(0, 0).z(), 2.5, 1e-12);
  EXPECT_EQ(planes[1].grid.normal, Vector3d(-Vector3d::UnitZ()));
  // A ceiling that nobody saw is nowhere; rays above and below a storey are not of it.
  scene.building.storeys[0].ceiling_m.reset();
  EXPECT_EQ(StoreyPlanes(scene.building, scene.rays, {}).size(), 1u);
  scene.building.storeys[0].floor_m = 3;
  EXPECT_TRUE(StoreyPlanes(scene.building, scene.rays, {}).empty());
  EXPECT_TRUE(StoreyPlanes(scene.building, {}, {}).empty());
}

// What is filled is a surface as what is measured.

TEST(FilledPoints, AreOccupied) {
  MapResult map;
  const Eigen::Vector3d filled(2, 1, 1.02);
  AddFilledPoints({PointAt(filled, 0.01)}, 0.05, &map);
  ASSERT_EQ(map.filled.size(), 1u);
  EXPECT_EQ(map.filled[0].p_world, filled);
  EXPECT_TRUE(map.dense.empty());
  EXPECT_TRUE(map.occupancy.IsOccupied(filled));
  EXPECT_FALSE(map.occupancy.IsOccupied(filled + Eigen::Vector3d(0, 0, 0.5)));
}

const double kBeside_m = PlaneOptions().beside_m;

void AddPatch(double from_x, double to_x, double z, uint8_t grey, std::vector<DensePoint>* cloud) {
  for (double x = from_x; x < to_x; x += 0.05) {
    for (double y = 1; y < 2; y += 0.05) {
      cloud->push_back({{x, y, z}, Eigen::Vector3d::UnitZ(), 0.01, grey});
    }
  }
}

TEST(MeasuredAround, TellsNothingBetweenTwoSurfacesOrOfWhatFacesTheOtherWayOrIsFarOff) {
  std::vector<DensePoint> cloud, others;
  AddPatch(1, 2, 0, 90, &cloud);
  AddPatch(2.2, 3, 0.08, 90, &cloud);
  const PlaneGrid grid = testing::FloorGrid();
  const MeasuredAround around(grid, cloud, {}, kBeside_m);
  EXPECT_FALSE(around.At(20.9, 15));
  ASSERT_TRUE(around.At(18, 15) && around.At(26, 15));
  EXPECT_NEAR(around.At(18, 15)->offset_m, 0, 1e-9);
  EXPECT_NEAR(around.At(26, 15)->offset_m, 0.08, 1e-9);
  AddPatch(1, 2, 0, 90, &others);
  for (DensePoint& point : others) point.normal_world = -point.normal_world;
  AddPatch(1, 2, 0.3, 90, &others);
  EXPECT_FALSE(MeasuredAround(grid, others, {}, kBeside_m).At(15, 15));
  EXPECT_FALSE(MeasuredAround(grid, {}, {}, kBeside_m).At(15, 15));
}

TEST(MeasuredAround, BlankPlaceIsOnThePlaneWhoseBorderIsSeen) {
  const PlaneGrid grid = testing::FloorGrid();
  const double middle_m = 0.5 * grid.columns * grid.cell_m, end_m = grid.rows * grid.cell_m;
  MapLine border, inner;
  border.start_world = grid.At(0, 0) + 0.002 * grid.normal;
  border.end_world = border.start_world + grid.columns * grid.cell_m * grid.u;
  inner.start_world = border.start_world + 0.4 * end_m * grid.v + 0.5 * grid.u;
  inner.end_world = border.end_world + 0.4 * end_m * grid.v - 0.5 * grid.u;
  const double column = middle_m / grid.cell_m, row = 0.5 * grid.rows;
  EXPECT_FALSE(MeasuredAround(grid, {}, {}, kBeside_m).OnPlane(column, row));
  const auto surface = MeasuredAround(grid, {}, {border, inner}, kBeside_m).OnPlane(column, row);
  ASSERT_TRUE(surface);
  EXPECT_EQ(surface->offset_m, 0);
  EXPECT_NEAR(surface->nearest_m, 0.5 * end_m, 0.03);  // not the inner one, 0.1 of it away
  EXPECT_FALSE(MeasuredAround(grid, {}, {inner}, kBeside_m).OnPlane(column, row));
  MapLine beyond = border;
  beyond.start_world -= grid.v;
  beyond.end_world -= grid.v;
  EXPECT_FALSE(MeasuredAround(grid, {}, {beyond}, kBeside_m).OnPlane(column, row));
}

TEST(MeasuredAround, BlankPlaceIsNotOnThePlaneBesideSomethingElseOrAPaneBehind) {
  const PlaneGrid grid = testing::FloorGrid();
  std::vector<DensePoint> wall, leaf, pane;
  AddPatch(1, 2, 0, 90, &wall);
  leaf = pane = wall;
  AddPatch(2.2, 2.3, -0.06, 90, &leaf);
  AddPatch(2.3, 2.6, -0.2, 90, &pane);
  const double column = 2.25 / grid.cell_m, row = 15;
  EXPECT_TRUE(MeasuredAround(grid, wall, {}, kBeside_m).OnPlane(column, row));
  EXPECT_FALSE(MeasuredAround(grid, leaf, {}, kBeside_m).OnPlane(column, row));
  EXPECT_FALSE(MeasuredAround(grid, pane, {}, kBeside_m).OnPlane(column, row));
  // Nearer to the wall than to the pane.
  EXPECT_TRUE(MeasuredAround(grid, pane, {}, kBeside_m).OnPlane(2.1 / grid.cell_m, row));
}

// The plane y = 2, 1 m square, seen from y = 0.
PlaneGrid WallGrid() {
  PlaneGrid grid;
  grid.normal = -Eigen::Vector3d::UnitY();
  grid.u = Eigen::Vector3d::UnitX();
  grid.v = Eigen::Vector3d::UnitZ();
  grid.offset_m = -2;
  grid.cell_m = 0.1;
  grid.columns = grid.rows = 10;
  return grid;
}

int Passes(const Eigen::Vector3d& from, const Eigen::Vector3f& to, float sigma_m) {
  const cv::Mat1i passes = CountPasses(WallGrid(), {{from, {to}, {sigma_m}}});
  int sum = 0;
  for (const int count : passes) sum += count;
  return sum;
}

TEST(CountPasses, CountsRaysThatPassThePlaneForSure) {
  const std::tuple<const char*, Eigen::Vector3d, Eigen::Vector3f, float, int> rays[] = {
      {"ends behind", {0.5, 0, 0.5}, {0.5F, 4, 0.5F}, 0.01F, 1},
      {"from the other side", {0.5, 4, 0.5}, {0.5F, 1, 0.5F}, 0.01F, 1},
      {"ends at the plane", {0.5, 0, 0.5}, {0.5F, 2.05F, 0.5F}, 0.01F, 0},
      {"ends before it", {0.5, 0, 0.5}, {0.5F, 1, 0.5F}, 0.01F, 0},
      {"ends clearly behind", {0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.01F, 1},
      {"may end at the plane", {0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.2F, 0},
      {"goes beside", {3, 0, 0.5}, {3, 4, 0.5F}, 0.01F, 0}};
  for (const auto& [what, from, to, sigma_m, count] : rays) {
    EXPECT_EQ(Passes(from, to, sigma_m), count) << what;
  }
}

}  // namespace
}  // namespace slcmap
