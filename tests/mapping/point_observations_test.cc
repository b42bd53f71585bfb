// Which images saw a map's points: from the run to the map's folder and back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "mapping/map/evidence_files.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class PointObservationsTest : public ::testing::Test {
 protected:
  // Where the map's rig sees a point.
  static Vector2d DistortToPixel(const MapResult& map, const MapPointObservation& seen) {
    const Rig& rig = map.rectified_rig;
    for (const StampedPose& pose : map.keyframes) {
      if (pose.stamp_ns != seen.stamp_ns) continue;
      const RigidTransform T_world_camera = pose.T_world_imu * rig.T_imu_camera[seen.camera];
      return *rig.cameras[seen.camera].Project(T_world_camera.Inverse() *
                                               map.points[seen.point].p_world);
    }
    ADD_FAILURE() << "no keyframe";
    return Vector2d::Zero();
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("map");
  const std::string path_ = folder_ + "/" + kPointObservationFile;
};

TEST_F(PointObservationsTest, SayWhereEachImageShowsAPoint) {
  const OdometryRun run = testing::MakeWallRun();
  const MapResult map = MapRun(run, nullptr, {});
  std::set<int64_t> points;
  for (const MapPointObservation& seen : map.point_observations) {
    points.insert(seen.point);
    EXPECT_LT((DistortToPixel(map, seen) - seen.px).norm(), 1e-6);
  }
  EXPECT_EQ(points.size(), map.points.size());
  // All but what was no point: in both images of each keyframe.
  std::size_t landmarks = 0;
  for (const MapPoint& point : map.points) landmarks += point.landmark_ids.size();
  EXPECT_EQ(map.point_observations.size(), 2 * run.keyframes.size() * landmarks);
  EXPECT_TRUE(std::ranges::is_sorted(
      map.point_observations, {}, [](const MapPointObservation& seen) { return MakeKey(seen); }));
}

// They are different features, beside each other.
TEST_F(PointObservationsTest, LandmarksThatBecameOnePointAreTracksOfIt) {
  OdometryRun run = testing::MakeWallRun();
  MappingOptions options;
  options.cloud.voxel_m = 0.5;
  run.keyframes[1].observations[0].right_px.reset();
  const MapResult map = MapRun(run, nullptr, options);
  ASSERT_LT(map.points.size(), 100u);
  std::size_t tracks = 0;
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    std::set<int> of_point;
    for (const MapPointObservation& seen : map.point_observations) {
      if (seen.point == static_cast<int64_t>(i)) of_point.insert(seen.track);
    }
    EXPECT_EQ(of_point.size(), map.points[i].landmark_ids.size());
    EXPECT_EQ(*of_point.rbegin() + 1, std::ssize(map.points[i].landmark_ids));
    tracks += of_point.size();
  }
  EXPECT_EQ(map.point_observations.size(), 2 * run.keyframes.size() * tracks - 1);
}

// The images that a map speaks of are rectified with what the run has found of its cameras.
TEST_F(PointObservationsTest, FollowWhatWasFoundOfTheCameras) {
  OdometryRun run = testing::MakeWallRun();
  run.source.emplace();
  run.source->raw_rig = run.rectified_rig;
  CalibrationEstimate found;
  found.right_rotation_rad = {0.01, -0.004, 0.02};
  found.focal_length = 0.005;
  found.right_centre_px = {1.5, -0.8};
  run.calibration = {found};
  // As the true cameras saw it, and as it was rectified with the given ones.
  Rig true_rig = run.rectified_rig;
  true_rig.T_imu_camera[1].rotation =
      true_rig.T_imu_camera[1].rotation * ExpRotation(found.right_rotation_rad);
  for (Camera& camera : true_rig.cameras) {
    camera.fx_px *= 1 + found.focal_length;
    camera.fy_px *= 1 + found.focal_length;
  }
  true_rig.cameras[1].cx_px += found.right_centre_px.x();
  true_rig.cameras[1].cy_px += found.right_centre_px.y();
  for (Keyframe& keyframe : run.keyframes) {
    for (std::size_t i = 0; i < keyframe.observations.size(); ++i) {
      const auto px = [&](int camera) {
        return *true_rig.cameras[camera].Project(
            (keyframe.T_world_imu * true_rig.T_imu_camera[camera]).Inverse() *
            run.landmarks[i].p_world);
      };
      keyframe.observations[i].left_px = px(0);
      keyframe.observations[i].right_px = px(1);
    }
  }
  const MapResult map = MapRun(run, nullptr, {});
  ASSERT_FALSE(map.point_observations.empty());
  for (const MapPointObservation& seen : map.point_observations) {
    EXPECT_LT((DistortToPixel(map, seen) - seen.px).norm(), 0.01);
  }
}

TEST_F(PointObservationsTest, ComeBack) {
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  WriteMapFolder(folder_, map);
  const std::vector<MapPointObservation> read = ReadMapFolder(folder_).point_observations;
  ASSERT_EQ(read.size(), map.point_observations.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(MakeKey(read[i]), MakeKey(map.point_observations[i]));
    EXPECT_LT((read[i].px - map.point_observations[i].px).norm(), 0.001);
  }
}

// As of a run that was cut off.
TEST_F(PointObservationsTest, TracksOfAPointCountFromZeroWhateverWasSeen) {
  OdometryRun run = testing::MakeWallRun();
  const int64_t unseen = MapRun(run, nullptr, {}).points[0].landmark_ids[0];
  MappingOptions options;
  options.cloud.voxel_m = 0.5;
  for (Keyframe& keyframe : run.keyframes) {
    std::erase_if(keyframe.observations,
                  [&](const KeyframeObservation& seen) { return seen.landmark_id == unseen; });
  }
  WriteMapFolder(folder_, MapRun(run, nullptr, options));
  const MapResult map = ReadMapFolder(folder_);
  const auto point = std::ranges::find(map.point_observations, 0, &MapPointObservation::point);
  ASSERT_NE(point, map.point_observations.end());
  EXPECT_EQ(point->track, 0);
}

// Files refuse what cannot be, so it is not written.
TEST_F(PointObservationsTest, AreFinite) {
  OdometryRun run = testing::MakeWallRun();
  run.keyframes[0].observations[3].left_px.x() = std::nan("");
  run.keyframes[1].observations[3].right_px->y() = 1e9;
  const MapResult map = MapRun(run, nullptr, {});
  WriteMapFolder(folder_, map);
  EXPECT_EQ(ReadMapFolder(folder_).point_observations.size(),
            MapRun(testing::MakeWallRun(), nullptr, {}).point_observations.size() - 2);
}

TEST_F(PointObservationsTest, MapsOfEarlierVersionsHaveNone) {
  WriteMapFolder(folder_, MapRun(testing::MakeWallRun(), nullptr, {}));
  std::filesystem::remove(path_);
  Json summary = Json::parse(ReadFile(folder_ + "/map.json"));
  summary["counts"].erase("point_observations");
  Json& files = summary["files"];
  files.erase(
      std::remove_if(files.begin(), files.end(),
                     [](const Json& file) { return file.at("name") == kPointObservationFile; }),
      files.end());
  summary.erase("id");
  summary.erase("checksum");
  WriteSummaryFile(folder_ + "/map.json", summary);
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_FALSE(read.points.empty());
  EXPECT_TRUE(read.point_observations.empty());
}

TEST_F(PointObservationsTest, DamagedTablesAreNamed) {
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  WriteMapFolder(folder_, map);
  const std::string header = "point,track,stamp_ns,camera,x_px,y_px\n";
  const std::string stamp = std::to_string(map.keyframes[0].stamp_ns);
  const auto expect_refused = [&](const std::string& rows, const std::string& message) {
    WriteFile(path_, header + rows);
    for (const bool accept : {false, true}) {
      EXPECT_THAT([&] { ReadMapFolder(folder_, {.accept_changed = accept}); },
                  ThrowsMessage<DataError>(HasSubstr("point_observations.csv: row " + message)));
    }
  };
  const std::string good = "0,0," + stamp + ",0,1,2\n";
  expect_refused("0,0," + stamp + ",0,1\n", "2: found 5 columns, expected 6");
  expect_refused("100000,0," + stamp + ",0,1,2\n",
                 "2: point: found '100000', expected less than the " +
                     std::to_string(map.points.size()) + " points");
  expect_refused("-1,0," + stamp + ",0,1,2\n", "2: point: found '-1', expected");
  expect_refused("0,1," + stamp + ",0,1,2\n", "2: track: found '1', expected at most 0");
  expect_refused(good + "0,2," + stamp + ",0,1,2\n", "3: track: found '2', expected at most 1");
  expect_refused("0,0,12,0,1,2\n", "2: stamp_ns: found '12', expected the stamp of a pose");
  expect_refused("0,0," + stamp + ",2,1,2\n", "2: camera: found '2', expected 0 to 1");
  expect_refused("0,0," + stamp + ",0,inf,2\n", "2: x_px: found 'inf', expected");
  expect_refused("0,0," + stamp + ",0,1,1e9\n", "2: y_px: found '1e9', expected");
  expect_refused(good + good, "3: point: found '0', expected rows in the order of");
  WriteFile(path_, header + good);
  EXPECT_THAT([&] { ReadMapFolder(folder_); },
              ThrowsMessage<DataError>(HasSubstr("found 1 point_observations, expected ")));
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).point_observations.size(), 1u);
}

}  // namespace
}  // namespace slcmap
