// The map of a rig that moves, from its images: what is mapped lies where the building is.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <opencv2/core/utility.hpp>

#include "data/core/math.h"
#include "data/simulator/motion.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "mapping/views/recorded_views.h"
#include "odometry/odometry.h"
#include "odometry/run/run.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/room_views.h"
#include "tests/testing/temp_folder.h"

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

TEST_F(MovingMap, PointsLinesAndOccupiedVoxelsLieOnTheWallsAndTheWayIsFree) {
  const MapResult& map = flight_->map;
  const std::vector<Voxel> voxels = map.occupancy.OccupiedVoxels();
  ASSERT_GT(map.points.size(), 100u);
  ASSERT_GE(map.lines.size(), 2u);
  ASSERT_GT(voxels.size(), 50u);
  const auto is_near = [&](const Eigen::Vector3d& p, double within_m = 0.1) {
    return flight_->DistanceFromWalls_m(p) < within_m;
  };
  const auto share = [](const auto& items, auto is) {
    return static_cast<double>(std::ranges::count_if(items, is)) /
           static_cast<double>(items.size());
  };
  EXPECT_GT(share(map.points, [&](const MapPoint& p) { return is_near(p.p_world); }), 0.9);
  EXPECT_GT(share(map.lines,
                  [&](const MapLine& line) {
                    return is_near(line.start_world) && is_near(line.end_world);
                  }),
            0.75);
  EXPECT_GT(share(voxels, [&](const Voxel& v) { return is_near(v.centre_world, 0.2); }), 0.9);
  int64_t free = 0;
  for (const StampedPose& pose : map.trajectory) {
    EXPECT_FALSE(map.occupancy.IsOccupied(pose.T_world_imu.translation));
    free += map.occupancy.IsFree(pose.T_world_imu.translation);
  }
  EXPECT_GT(free, 0);
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

constexpr double kRoom_s = 3;

MapResult MapOf(const Views& views, const MappingOptions& options = {}) {
  auto room = std::make_unique<RoomViews>(kRoom_s, 0.25, 3);
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
TEST(MappedImages, ThatAreNotThoseOfTheRunAreWarnedOfAlsoWithoutLines) {
  const Views as_taken = RoomViews(kRoom_s, 0.25, 3).views();
  Views views = as_taken;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].T_world_imu = as_taken[(5 * i + 7) % views.size()].T_world_imu;
  }
  MappingOptions options;
  options.stages.lines = options.stages.building = false;
  const MapResult map = MapOf(views, options);
  EXPECT_EQ(map.warnings.at("poses_disagree"), 1);
  // The run of these views has no lines of its own.
  EXPECT_TRUE(map.lines.empty());
  EXPECT_TRUE(map.building.planes.empty());
  EXPECT_EQ(map.warnings.at("no_lines"), 1);
}

TEST(MappedImages, GiveTheSameMapOnAnyNumberOfThreads) {
  const Views views = RoomViews(kRoom_s, 0.25, 3).views();
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const MapResult map = MapOf(views);
  cv::setNumThreads(3);
  const MapResult again = MapOf(views);
  cv::setNumThreads(threads);
  EXPECT_TRUE(map.complete);
  EXPECT_FALSE(map.warnings.contains("poses_disagree"));
  EXPECT_FALSE(map.warnings.contains("no_lines"));
  EXPECT_FALSE(map.dense.empty());
  EXPECT_FALSE(map.filled.empty());
  EXPECT_FALSE(map.lines.empty());
  EXPECT_FALSE(map.building.planes.empty());
  EXPECT_TRUE(map.seen_share);
  const testing::TempFolder folder;
  EXPECT_EQ(WriteMapFolder(folder.Path("a"), map), WriteMapFolder(folder.Path("b"), again));
}

}  // namespace
}  // namespace slcmap
