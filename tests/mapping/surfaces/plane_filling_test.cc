// A wall of which stereo measured a part: what is filled, and what must not be.
#include "mapping/surfaces/plane_filling.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/testing/box_room_renderer.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kWall_m = 2.5;  // y of the wall, which is seen from y = 0

struct Box {
  double from_x, to_x, low_z, high_z;

  bool Holds(const Vector3d& p) const {
    return p.x() > from_x && p.x() < to_x && p.z() > low_z && p.z() < high_z;
  }
};

constexpr Box kHole = {-0.3, 0.3, 1.2, 1.8};  // that stereo has left in the wall

void AddMeasured(const Box& box, const Box& hole, double y, std::vector<DensePoint>* dense) {
  for (double x = box.from_x; x < box.to_x; x += 0.04) {
    for (double z = box.low_z; z < box.high_z; z += 0.04) {
      if (hole.Holds({x, y, z})) continue;
      dense->push_back({{x, y, z}, -Vector3d::UnitY(), 0.01, 100});
    }
  }
}

// The wall, 3 m high from x = -2 to 2, measured from x = -1 to 1 but in the hole.
struct Scene {
  std::vector<DensePoint> dense;
  std::vector<MapLine> lines;
  Building building;
  std::vector<ViewRays> rays;
  Views views;

  explicit Scene(double measured_y = kWall_m) {
    AddMeasured({-1, 1, 0, 3}, kHole, measured_y, &dense);
    BuildingPlane wall;
    wall.kind = PlaneKind::kWall;
    wall.normal = -Vector3d::UnitY();
    wall.offset_m = -kWall_m;
    wall.sigma_m = 0.005;
    wall.outline_world = {{-2, kWall_m, 0}, {2, kWall_m, 0}, {2, kWall_m, 3}, {-2, kWall_m, 3}};
    building.planes = {wall};
    Eigen::Matrix3d R_world_camera;
    R_world_camera << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    for (int i = 0; i < 4; ++i) {
      views.push_back(
          {i * 100000000, 0, {Eigen::Quaterniond(R_world_camera), {0.2 * i - 0.3, 0, 1.5}}});
    }
  }

  void AddEdge(const Vector3d& start, const Vector3d& end) {
    MapLine edge;
    edge.start_world = start;
    edge.end_world = end;
    edge.kind = LineKind::kEdge;
    lines.push_back(edge);
  }

  std::vector<DensePoint> Fill(const Progress& progress = {}) const {
    Rig rig = SmallRig();
    for (RigidTransform& T_imu_camera : rig.T_imu_camera) T_imu_camera = {};
    const ViewCameras cameras(views, rig);
    return FillPlanes({dense, lines, building, rays, {cameras}, 0.04}, {}, progress);
  }
};

// The share of a part of the wall that is filled, by cells of 5 cm.
double Share(const std::vector<DensePoint>& points, const Box& box) {
  const auto inside = std::count_if(points.begin(), points.end(), [&](const DensePoint& point) {
    return box.Holds(point.p_world);
  });
  return static_cast<double>(inside) * 0.05 * 0.05 /
         ((box.to_x - box.from_x) * (box.high_z - box.low_z));
}

TEST(FillPlanes, FillsAHoleInAWallOnceAndNothingWhenAsked) {
  Scene scene;
  const std::vector<DensePoint> points = scene.Fill();
  EXPECT_GT(Share(points, {-0.25, 0.25, 1.25, 1.75}), 0.95);
  EXPECT_EQ(Share(points, {-0.9, -0.4, 1, 2}), 0) << "was measured";
  EXPECT_EQ(Share(points, {0.4, 0.9, 1, 2}), 0);
  for (const DensePoint& point : points) {
    EXPECT_NEAR(point.p_world.y(), kWall_m, 1e-9);
    EXPECT_LT(point.normal_world.y(), -0.99);
    EXPECT_EQ(point.grey, 100);
    EXPECT_EQ(point.sigma_m, 0.005);
  }
  scene.building.planes.push_back(scene.building.planes[0]);
  EXPECT_EQ(scene.Fill().size(), points.size()) << "a plane that is there twice";
  EXPECT_TRUE(scene.Fill(Progress([](double) { return false; })).empty());
}

TEST(FillPlanes, FollowsAWallThatBends) {
  const std::vector<DensePoint> points = Scene(kWall_m + 0.02).Fill();
  ASSERT_FALSE(points.empty());
  for (const DensePoint& point : points) {
    const bool is_near = std::abs(point.p_world.x()) < 1.4;
    EXPECT_NEAR(point.p_world.y(), is_near ? kWall_m + 0.02 : kWall_m, is_near ? 1e-9 : 0.021);
  }
}

TEST(FillPlanes, FillsABlankWallFromItsEdges) {
  Scene scene;
  scene.dense.clear();
  EXPECT_TRUE(scene.Fill().empty());
  for (const double z : {0.0, 3.0}) scene.AddEdge({-1.9, kWall_m, z}, {1.9, kWall_m, z});
  const std::vector<DensePoint> points = scene.Fill();
  EXPECT_GT(Share(points, {-0.6, 0.6, 0.9, 2.1}), 0.95);
  for (const DensePoint& point : points) EXPECT_NEAR(point.p_world.y(), kWall_m, 1e-9);
  scene.building.planes[0].sigma_m = 0.1;
  EXPECT_TRUE(scene.Fill().empty());
}

TEST(FillPlanes, GoesNoFartherThanItsReach) {
  Scene scene;
  scene.building.planes[0].sigma_m = 0.1;  // the plane itself is not known
  scene.building.planes[0].outline_world[1].x() = scene.building.planes[0].outline_world[2].x() = 4;
  const std::vector<DensePoint> points = scene.Fill();
  EXPECT_GT(Share(points, {1.1, 1.4, 1.2, 1.8}), 0.8);
  EXPECT_EQ(Share(points, {1.6, 4, 0, 3}), 0);
  scene.building.planes[0].sigma_m = 0.005;
  EXPECT_GT(Share(scene.Fill(), {1.6, 1.9, 1.2, 1.8}), 0.8);
  scene.building.planes[0].inferred = true;
  EXPECT_TRUE(scene.Fill().empty());
}

TEST(FillPlanes, LeavesOutADoorLeafBehindThePlane) {
  Scene scene;
  scene.dense.clear();
  AddMeasured({-1, 1, 0, 3}, {-0.5, 0.5, 1, 2}, kWall_m, &scene.dense);
  AddMeasured({-0.5, 0.5, 1, 2}, kHole, kWall_m + 0.06, &scene.dense);
  EXPECT_EQ(Share(scene.Fill(), kHole), 0);
}

TEST(FillPlanes, LeavesOutWhatALinePartsFromTheWallAndOpenings) {
  Scene scene, with_window;
  for (const double x : {-0.28, 0.28}) {
    scene.AddEdge({x, kWall_m + 0.03, 0}, {x, kWall_m + 0.03, 3});
  }
  for (const double middle :
       {-0.22, 0.22}) {  // to which the nearest of the wall is behind the line
    const Box box{middle - 0.04, middle + 0.04, 1.4, 1.6};
    EXPECT_EQ(Share(scene.Fill(), box), 0);
    EXPECT_GT(Share(with_window.Fill(), box), 0.5);
  }
  with_window.building.planes[0].openings.emplace_back().outline_world = {
      {-0.3, kWall_m, 1.2}, {0.3, kWall_m, 1.2}, {0.3, kWall_m, 1.8}, {-0.3, kWall_m, 1.8}};
  EXPECT_EQ(Share(with_window.Fill(), kHole), 0);
}

TEST(FillPlanes, LeavesOutWhatRaysPass) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    ViewRays rays{{0, 0, 1.5}, {}, {}};
    for (float x = -0.25F; x <= 0.25F; x += 0.02F) {
      for (float z = -0.25F; z <= 0.25F; z += 0.02F) {
        rays.p_world.emplace_back(2 * x, 2 * kWall_m, 1.5F + 2 * z);
        rays.sigma_m.push_back(0.02F);
      }
    }
    scene.rays.push_back(rays);
  }
  EXPECT_EQ(Share(scene.Fill(), {-0.2, 0.2, 1.3, 1.7}), 0);
}

TEST(FillPlanes, LeavesOutWhatNoCameraSees) {
  Scene scene;
  AddMeasured({-1, 1, 0, 3}, {9, 9, 9, 9}, 1.5, &scene.dense);
  EXPECT_EQ(Share(scene.Fill(), {-0.2, 0.2, 1.3, 1.7}), 0);
  for (View& view : scene.views) view.T_world_imu.translation.y() = 6;
  EXPECT_TRUE(scene.Fill().empty());
}

TEST(FillPlanes, LeavesOutWhatABlankWallHides) {
  Scene scene;
  scene.dense.clear();
  constexpr double kBehind_m = 4;  // y of another wall
  BuildingPlane behind = scene.building.planes[0];
  behind.offset_m = -kBehind_m;
  for (Vector3d& p : behind.outline_world) p.y() = kBehind_m;
  scene.building.planes.push_back(behind);
  for (const double y : {kWall_m, kBehind_m}) {
    for (const double z : {0.0, 3.0}) scene.AddEdge({-1.9, y, z}, {1.9, y, z});
  }
  const auto is_behind = [](const DensePoint& point) { return point.p_world.y() > 3; };
  const std::vector<DensePoint> points = scene.Fill();
  EXPECT_GT(points.size(), 500);
  EXPECT_EQ(std::ranges::count_if(points, is_behind), 0);
  scene.building.planes.erase(scene.building.planes.begin());
  EXPECT_GT(std::ranges::count_if(scene.Fill(), is_behind), 500);
}

TEST(FillPlanes, AFloorThatIsSeenSlantinglyDoesNotHideItself) {
  Scene scene;
  scene.dense.clear();
  BuildingPlane floor;
  floor.kind = PlaneKind::kWall;  // as walls are filled from their edges
  floor.normal = Vector3d::UnitZ();
  floor.sigma_m = 0.005;
  floor.outline_world = {{-1, 4, 0}, {1, 4, 0}, {1, 7, 0}, {-1, 7, 0}};
  scene.building.planes = {floor};
  for (const double x : {-1, 1}) scene.AddEdge({x, 4, 0}, {x, 7, 0});
  for (View& view : scene.views) view.T_world_imu.translation.z() = 0.9;
  const std::vector<DensePoint> points = scene.Fill();
  EXPECT_GT(points.size(), 0.9 * 2 * 3 / (0.05 * 0.05));
}

}  // namespace
}  // namespace slcmap
