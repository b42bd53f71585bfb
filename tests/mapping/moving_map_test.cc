// The map of a rig that moves, from its images: what is mapped lies where the building is.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>

#include "data/core/math.h"
#include "data/simulator/motion.h"
#include "mapping/mapping.h"
#include "mapping/views/recorded_views.h"
#include "odometry/odometry.h"
#include "odometry/run/run.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

constexpr double kRest_s = 1, kDuration_s = 6, kRate_hz = 20;
constexpr double kWallDistance_m = 2.5, kPanel_m = 2;

// A flight through a bare room of panels, and the map of it.
struct MappedFlight {
  Eigen::AlignedBox3d room;  // in the true world
  MapResult map;
  OdometryRun run;
  RigidTransform T_true_world;  // from the map's world to the true one
  RigidTransform true_end;      // T_world_imu of the last pose

  // How far a point of the map is from the nearest wall, floor or ceiling.
  double DistanceFromWalls_m(const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d p = T_true_world * p_world;
    return std::min((p - room.min()).cwiseAbs().minCoeff(), (p - room.max()).cwiseAbs().minCoeff());
  }
};

MappedFlight MakeMappedFlight() {
  RenderTask task{SmallRig(), ExampleFlight(SmallRig(), kDuration_s, kRest_s), {}};
  for (double t_s = 0.1; t_s < kDuration_s - 0.1; t_s += 1 / kRate_hz) task.times_s.push_back(t_s);
  BoxRoomRenderer renderer(task, kWallDistance_m, kPanel_m);
  OdometryOptions options;
  options.points.min_distance_px = 10;
  options.keyframes.min_parallax_px = 6;
  Odometry odometry(task.rig, options, 1);
  for (const ImuSample& sample : SimulateImu(task.motion, {}).samples) odometry.AddImu(sample);
  for (size_t i = 0; i < task.times_s.size(); ++i) {
    const RenderedPair pair = renderer.Render(static_cast<int>(i), false);
    odometry.AddStereo({ToNanoseconds(task.times_s[i]), pair.left, pair.right});
  }
  odometry.Finish();

  MappedFlight flight;
  flight.room = renderer.room();
  flight.run = odometry.Run();
  // At the images' small size lines are less certain than the map's limit asks for.
  MappingOptions mapping;
  mapping.run_lines.max_sigma_m = 0.03;
  flight.map = MapRun(flight.run, nullptr, mapping);
  if (flight.map.trajectory.empty()) return flight;
  const auto truth = [&](const StampedPose& pose) {
    return task.motion.PoseAt(ToSeconds(pose.stamp_ns));
  };
  const StampedPose& first = flight.map.trajectory.front();
  flight.T_true_world = truth(first) * first.T_world_imu.Inverse();
  flight.true_end = truth(flight.map.trajectory.back());
  return flight;
}

class MovingMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { flight_ = std::make_unique<MappedFlight>(MakeMappedFlight()); }
  static void TearDownTestSuite() { flight_.reset(); }
  static inline std::unique_ptr<MappedFlight> flight_;
};

TEST_F(MovingMap, TheRefinedTrajectoryEndsWhereTheRigDid) {
  const Trajectory& trajectory = flight_->map.trajectory;
  ASSERT_GT(trajectory.size(), 90u);
  const RigidTransform end = flight_->T_true_world * trajectory.back().T_world_imu;
  const RigidTransform start = flight_->T_true_world * trajectory.front().T_world_imu;
  EXPECT_GT((end.translation - start.translation).norm(), 0.5);  // it moved
  EXPECT_LT((end.translation - flight_->true_end.translation).norm(), 0.05);
}

TEST_F(MovingMap, PointsLieOnTheWalls) {
  ASSERT_GT(flight_->map.points.size(), 100u);
  int64_t near = 0;
  for (const MapPoint& point : flight_->map.points) {
    near += flight_->DistanceFromWalls_m(point.p_world) < 0.1;
  }
  EXPECT_GT(near, 0.9 * static_cast<double>(flight_->map.points.size()));
}

TEST_F(MovingMap, LinesLieOnTheWallsFromEndToEnd) {
  ASSERT_GE(flight_->map.lines.size(), 2u);
  int64_t near = 0;
  for (const MapLine& line : flight_->map.lines) {
    near += flight_->DistanceFromWalls_m(line.start_world) < 0.1 &&
            flight_->DistanceFromWalls_m(line.end_world) < 0.1;
  }
  EXPECT_GT(near, 0.75 * static_cast<double>(flight_->map.lines.size()));
}

TEST_F(MovingMap, TheWayIsFreeAndOccupiedVoxelsAreOnTheWalls) {
  const OccupancyMap& occupancy = flight_->map.occupancy;
  int64_t free = 0, near = 0;
  for (const StampedPose& pose : flight_->map.trajectory) {
    EXPECT_FALSE(occupancy.IsOccupied(pose.T_world_imu.translation));
    free += occupancy.IsFree(pose.T_world_imu.translation);
  }
  EXPECT_GT(free, 0);
  const std::vector<Voxel> voxels = occupancy.OccupiedVoxels();
  ASSERT_GT(voxels.size(), 50u);
  for (const Voxel& voxel : voxels) {
    near += flight_->DistanceFromWalls_m(voxel.centre_world) < 0.2;
  }
  EXPECT_GT(near, 0.9 * static_cast<double>(voxels.size()));
}

// What goes on from the map, as bundle adjustment does, starts from errors of the tracker alone.
TEST_F(MovingMap, PointsAreWhereTheImagesShowThem) {
  const MapResult& map = flight_->map;
  const Rig& rig = map.rectified_rig;
  std::map<int64_t, RigidTransform> poses;
  for (const StampedPose& pose : map.keyframes) poses[pose.stamp_ns] = pose.T_world_imu;
  std::vector<double> off_px;
  for (const MapPointObservation& seen : map.point_observations) {
    const RigidTransform T_world_camera = poses.at(seen.stamp_ns) * rig.T_imu_camera[seen.camera];
    const Eigen::Vector3d& p_world = map.points[static_cast<size_t>(seen.point)].p_world;
    const auto px = rig.cameras[seen.camera].Project(T_world_camera.Inverse() * p_world);
    off_px.push_back(px ? (*px - seen.px).norm() : 1e3);
  }
  ASSERT_GT(off_px.size(), 6 * map.points.size());  // three keyframes and more, both cameras
  EXPECT_LT(Quantile(off_px, 0.5), 0.5);
  EXPECT_LT(Quantile(off_px, 0.9), 3);  // of fused points, whose landmarks lie apart
}

// Maps of runs whose images are opened again.

MapResult MapOf(const Views& views, const MappingOptions& options = {}) {
  auto room = std::make_unique<RoomViews>(4, 0.25, 3);
  OdometryRun run;
  run.method = MethodName(Method::kSlc);
  run.complete = true;
  run.rectified_rig = room->rig();
  for (size_t i = 0; i < views.size(); ++i) {
    run.states.push_back({.stamp_ns = views[i].stamp_ns, .T_world_imu = views[i].T_world_imu});
    run.keyframes.push_back(
        {static_cast<int64_t>(i), 0, views[i].stamp_ns, views[i].T_world_imu, {}, {}});
  }
  RecordedViews recorded;
  recorded.views = views;
  recorded.images = std::move(room);
  return MapRun(run, &recorded, options);
}

// As those of another recording, or of cameras that were exchanged, at the same stamps.
TEST(MappedImages, ThatAreNotThoseOfTheRunAreWarnedOf) {
  const Views as_taken = RoomViews(4, 0.25, 3).views();
  Views views = as_taken;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].T_world_imu = as_taken[(5 * i + 7) % views.size()].T_world_imu;
  }
  EXPECT_EQ(MapOf(views).warnings.at("poses_disagree"), 1);
}

// The run of these views has no lines of its own.
TEST(MappedImages, StagesCanBeSkipped) {
  const Views views = RoomViews(4, 0.25, 3).views();
  const MapResult whole = MapOf(views);
  EXPECT_FALSE(whole.warnings.contains("poses_disagree"));
  EXPECT_FALSE(whole.lines.empty());
  EXPECT_FALSE(whole.building.planes.empty());
  EXPECT_FALSE(whole.warnings.contains("no_lines"));
  MappingOptions options;
  options.stages.lines = options.stages.building = false;
  const MapResult part = MapOf(views, options);
  EXPECT_FALSE(part.dense.empty());
  EXPECT_TRUE(part.lines.empty());
  EXPECT_TRUE(part.building.planes.empty());
  EXPECT_TRUE(part.complete);
  EXPECT_EQ(part.warnings.at("no_lines"), 1);
}

}  // namespace
}  // namespace slcmap
