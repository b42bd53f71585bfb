// A room that a camera looked around in: which share of it a map holds that has all of it, or lacks
// a wall.
#include "mapping/surfaces/seen_share.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/mapping/surfaces/made_planes.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kHalf_m = 2, kHeight_m = 2.5;  // of a square room around the origin

// Walls by their id: at x = 2, at y = 2, at x = -2, at y = -2.
Vector3d Inwards(int wall) {
  return -Vector3d(std::cos(wall * M_PI / 2), std::sin(wall * M_PI / 2), 0).array().round();
}

// At a place along a wall and a height.
Vector3d OnWall(int wall, double along_m, double z_m) {
  const Vector3d along = Vector3d::UnitZ().cross(Inwards(wall));
  return -kHalf_m * Inwards(wall) + along_m * along + z_m * Vector3d::UnitZ();
}

BuildingPlane WallPlane(int wall) {
  BuildingPlane plane =
      testing::MakePlane(PlaneKind::kWall, Inwards(wall),
                         {OnWall(wall, -kHalf_m, 0), OnWall(wall, kHalf_m, 0),
                          OnWall(wall, kHalf_m, kHeight_m), OnWall(wall, -kHalf_m, kHeight_m)});
  plane.id = wall;
  return plane;
}

Building SquareRoom() {
  Building building;
  building.storeys = {{0, 0, kHeight_m}};
  Room room;
  room.id = 4;
  room.polygon.outline = {
      {-kHalf_m, -kHalf_m}, {kHalf_m, -kHalf_m}, {kHalf_m, kHalf_m}, {-kHalf_m, kHalf_m}};
  room.height_m = kHeight_m;
  building.rooms = {room};
  for (int i = 0; i < 4; ++i) {
    building.planes.push_back(WallPlane(i));
    PlanWall wall;
    wall.id = 10 + i;
    wall.plane_ids = {i};
    building.walls.push_back(wall);
  }
  return building;
}

// All of its walls but one, its floor and its ceiling.
std::vector<DensePoint> PointsWithout(int lacking) {
  std::vector<DensePoint> points;
  for (double u = -kHalf_m; u < kHalf_m; u += 0.04) {
    for (double v = 0; v < 2 * kHalf_m; v += 0.04) {
      points.push_back({{u, v - kHalf_m, 0}, Vector3d::UnitZ()});
      points.push_back({{u, v - kHalf_m, kHeight_m}, -Vector3d::UnitZ()});
      for (int wall = 0; wall < 4 && v < kHeight_m; ++wall) {
        if (wall != lacking) points.push_back({OnWall(wall, u, v), Inwards(wall)});
      }
    }
  }
  return points;
}

MapResult MakeMap(int lacking = -1) {
  MapResult map;
  map.building = SquareRoom();
  map.dense = PointsWithout(lacking);
  return map;
}

// All around, and up and down.
Views LookAround() {
  Eigen::Matrix3d R_world_camera;
  R_world_camera << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  Views views;
  for (int i = 0; i < 72; ++i) {
    const Eigen::AngleAxisd turn(0.3 * i, Vector3d::UnitZ());
    const Eigen::AngleAxisd tilt(0.5 * (i % 3 - 1), Vector3d::UnitX());
    views.push_back({i, 0, {Eigen::Quaterniond(turn * tilt * R_world_camera), {0, 0, 1.25}}});
  }
  return views;
}

void Measure(MapResult* map, const std::vector<ViewRays>& rays = {}) {
  Rig rig = SmallRig();
  for (RigidTransform& T_imu_camera : rig.T_imu_camera) T_imu_camera = {};
  MeasureSeenShare({{ViewCameras(LookAround(), rig)}, rays}, {}, {}, map);
}

TEST(SeenShare, IsWholeOfAMapThatHasAll) {
  MapResult map = MakeMap();
  Measure(&map);
  EXPECT_GT(map.seen_share.value(), 0.98);
  EXPECT_GT(map.building.rooms[0].seen_share.value(), 0.98);
  for (const PlanWall& wall : map.building.walls) EXPECT_GT(wall.seen_share.value(), 0.98);
}

TEST(SeenShare, TellsAWallThatIsLackingByRoomAndWallUnlessItWasFilled) {
  MapResult map = MakeMap(1);
  Measure(&map);
  EXPECT_LT(map.building.walls[1].seen_share.value(), 0.1);
  for (const int other : {0, 2, 3}) EXPECT_GT(map.building.walls[other].seen_share.value(), 0.95);
  EXPECT_GT(map.seen_share.value(), 0.7);
  EXPECT_LT(map.seen_share.value(), 0.88);
  EXPECT_NEAR(map.building.rooms[0].seen_share.value(), *map.seen_share, 0.02);
  for (const DensePoint& point : MakeMap().dense) {
    if (point.normal_world.dot(Inwards(1)) > 0.5) map.filled.push_back(point);
  }
  Measure(&map);
  EXPECT_GT(map.seen_share.value(), 0.98);
  map.filled.clear();
  map.building.planes.erase(map.building.planes.begin() + 1);  // no plane is known of it
  Measure(&map);
  EXPECT_LT(map.seen_share.value(), 0.93);
  EXPECT_GT(map.seen_share.value(), 0.7);
}

TEST(SeenShare, AsksNothingOfWindowsAndOfWhatRaysWentThrough) {
  MapResult map = MakeMap(1);
  PlaneOpening window;
  window.kind = OpeningKind::kWindow;
  window.outline_world = map.building.planes[1].outline_world;
  map.building.planes[1].openings = {window};
  Measure(&map);
  EXPECT_GT(map.seen_share.value(), 0.95);

  map = MakeMap(1);
  for (DensePoint point : MakeMap().dense) {  // the wall is farther than its plane
    if (point.normal_world.dot(Inwards(1)) < 0.5) continue;
    point.p_world *= 1.4;
    map.dense.push_back(point);
  }
  ViewRays rays;
  for (double u = -kHalf_m; u < kHalf_m; u += 0.01) {
    for (double v = 0; v < kHeight_m; v += 0.01) {
      rays.p_world.push_back((1.4 * OnWall(1, u, v)).cast<float>());
      rays.sigma_m.push_back(0.01F);
    }
  }
  rays.p_world_camera = {0, 0, 1.25};
  Measure(&map, {rays});
  EXPECT_GT(map.seen_share.value(), 0.95);
}

TEST(SeenShare, IsNoneOfWhatIsMaskedOrOnceProgressSaysSo) {
  MapResult map = MakeMap(1);
  ViewCameras cameras(LookAround(), SmallRig());
  MeasureSeenShare({{cameras}, {}}, {}, Progress([](double) { return false; }), &map);
  EXPECT_FALSE(map.seen_share);
  const Camera& left = cameras.cameras[0];
  cameras.left_mask = cv::Mat(left.height_px, left.width_px, CV_8UC1, cv::Scalar(0));
  MeasureSeenShare({{cameras}, {}}, {}, {}, &map);
  EXPECT_FALSE(map.seen_share);
}

TEST(SeenShare, MakesAMapThatLacksMuchDoubtful) {
  MapResult map = MakeMap();
  JudgeSeenShare(&map);
  EXPECT_FALSE(map.verdict) << "it is not known";
  map.verdict.emplace();
  map.seen_share = map.building.rooms[0].seen_share = 0.61;
  JudgeSeenShare(&map);
  JudgeSeenShare(&map);
  EXPECT_EQ(map.verdict->level, VerdictLevel::kDoubtful);
  ASSERT_EQ(map.verdict->reasons.size(), 1);
  EXPECT_THAT(InWords(map.verdict->reasons[0]), HasSubstr("61 %"));
  EXPECT_THAT(map.verdict->reasons[0].found, HasSubstr("room 5: 61 %"));
  map.seen_share = 0.9;
  JudgeSeenShare(&map);
  EXPECT_EQ(map.verdict->level, VerdictLevel::kGood);
  EXPECT_TRUE(map.verdict->reasons.empty());
}

}  // namespace
}  // namespace slcmap
