// Which images saw a map's points: from the run to the map's folder and back.
#include "mapping/map/map_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/evidence_files.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/part_files.h"
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

std::vector<MergedRun> ThreeRuns() {
  return {{"a", "/recordings/day", "0.1.0", 0, {}, StampSpan{100, 200}},
          {"b", "/recordings/night", "0.2.0", -3600, LevelTransform(0.5, {1, -2, 0.25}),
           StampSpan{300, 400}},
          {"c", "", "0.2.0", 0, LevelTransform(-3, {0, 1, 0}), StampSpan{-50, 99}}};
}

MapSource SourceA() {
  MapSource source;
  source.run_id = "a";
  return source;
}

TEST(MergedRuns, AreReadAsTheyWereWritten) {
  std::vector<MergedRun> runs = ThreeRuns();
  runs[1].opened.cameras = {1, 2};
  const std::vector<MergedRun> read = ParseMerged("map.json", MergedJson(runs), SourceA());
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].opened.cameras, (std::vector<int>{1, 2}));
  EXPECT_TRUE(read[0].opened.cameras.empty());
  EXPECT_EQ(read[1].run_id, "b");
  EXPECT_EQ(read[1].sequence, "/recordings/night");
  EXPECT_EQ(read[1].version, "0.2.0");
  EXPECT_EQ(read[1].stamps_moved_ns, -3600);
  EXPECT_EQ(read[1].poses_ns->from_ns, 300);
  EXPECT_EQ(read[1].poses_ns->to_ns, 400);
  const RigidTransform off = read[1].T_world_run.Inverse() * ThreeRuns()[1].T_world_run;
  EXPECT_LT(off.translation.norm() + LogRotation(off.rotation).norm(), 1e-12);
}

// The first run's map may be turned against its run.
TEST(MergedRuns, TheFirstIsTurnedAsItsMapIs) {
  MapSource source = SourceA();
  source.T_world_run = LevelTransform(0.3, Eigen::Vector3d::Zero());
  std::vector<MergedRun> runs = ThreeRuns();
  runs[0].T_world_run = source.T_world_run;
  const std::vector<MergedRun> read = ParseMerged("map.json", MergedJson(runs), source);
  EXPECT_NEAR(ComputeYaw(read[0].T_world_run), 0.3, 1e-12);
  EXPECT_THAT([&] { ParseMerged("map.json", MergedJson(ThreeRuns()), source); },
              ThrowsMessage<DataError>(HasSubstr("run 0: found it moved, expected the first run")));
}

TEST(MergedRuns, MayBeWithoutStamps) {
  Json json = MergedJson(ThreeRuns());
  json[1].erase("first_pose_ns");
  json[1].erase("last_pose_ns");
  const std::vector<MergedRun> read = ParseMerged("map.json", json, SourceA());
  EXPECT_TRUE(read[0].poses_ns.has_value());
  EXPECT_FALSE(read[1].poses_ns.has_value());
}

// What is said of the list once a value in it is another.
void ExpectRefused(const std::string& pointer, const Json& value, const std::string& message) {
  Json json = MergedJson(ThreeRuns());
  json[Json::json_pointer(pointer)] = value;
  EXPECT_THAT([&] { ParseMerged("map.json", json, SourceA()); },
              ThrowsMessage<DataError>(HasSubstr("map.json: merged: " + message)))
      << pointer;
}

TEST(MergedRuns, WhatCannotBeIsNamed) {
  ExpectRefused("/1/stamps_moved_ns", 5e18,
                "run 1: stamps_moved_ns: found 5e+18, expected -4000000000000000000 to");
  ExpectRefused("/1/stamps_moved_ns", 1.5, "run 1: stamps_moved_ns: found 1.5, expected");
  ExpectRefused("/1/stamps_moved_ns", "x", "run 1: stamps_moved_ns: found \"x\", expected");
  ExpectRefused("/1/first_pose_ns", -5'000'000'000'000'000'000, "run 1: first_pose_ns: found -5");
  ExpectRefused("/1/last_pose_ns", 299, "run 1: last_pose_ns: found 299, expected 300 to");
  ExpectRefused("/2/last_pose_ns", 100, "run 2: found poses from -50 to 100 ns, expected none");
  ExpectRefused("/1/yaw_rad", 4.5, "run 1: yaw_rad: found 4.5, expected -4 to 4");
  ExpectRefused("/1/yaw_rad", nullptr, "run 1: yaw_rad: found null, expected -4 to 4");
  ExpectRefused("/1/position_m", Json{1, 2},
                "run 1: position_m: found the point [1,2], expected 3");
  ExpectRefused("/1/position_m/0", 1e7, "run 1: position_m: found the point [10000000.0,");
  ExpectRefused("/2/run", "b", "run 2: run: found b twice, expected each once");
  ExpectRefused("/0/run", "d", "run 0: run: found 'd', expected 'a' as in source");
  ExpectRefused("/0/stamps_moved_ns", 1, "run 0: found it moved, expected the first run as it was");
  ExpectRefused("/0/yaw_rad", 0.1, "run 0: found it moved, expected the first run as it was");
  ExpectRefused("/0/position_m/2", 0.1, "run 0: found it moved, expected the first run as it was");
}

TEST(MergedRuns, AreAList) {
  const auto refusal = [](const Json& json, const std::string& found) {
    EXPECT_THAT([&] { ParseMerged("map.json", json, SourceA()); },
                ThrowsMessage<DataError>("map.json: merged: found " + found +
                                         ", expected a list of two runs or more"));
  };
  refusal(nullptr, "'null'");
  refusal("a", "'string'");
  refusal(MergedJson(ThreeRuns())[0], "'object'");
  refusal(Json::array(), "0 runs");
  refusal(MergedJson({ThreeRuns()[0]}), "1 runs");
}

// A part of a run is missing, or of another type: named with the file, as everywhere.
TEST(MergedRuns, AreWhole) {
  const testing::TempFolder temp;
  const std::string folder = temp.Path("map");
  MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  const int64_t first_ns = map.trajectory.front().stamp_ns;
  const int64_t last_ns = map.trajectory.back().stamp_ns;
  map.source.run_id = "a";
  map.source.merged = {{"a", "", "", 0, {}, StampSpan{first_ns, first_ns + 2'000'000'000}},
                       {"b", "", "", 5, {}, StampSpan{first_ns + 2'100'000'000, last_ns}}};
  WriteMapFolder(folder, map);
  EXPECT_EQ(ReadMapFolder(folder).source.merged.size(), 2u);
  const Json good = Json::parse(ReadFile(folder + "/map.json"));
  const auto expect_refused = [&](const Json& json, const std::string& message) {
    WriteJsonFile(folder + "/map.json", json);
    EXPECT_THAT([&] { ReadMapFolder(folder, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr("map.json: " + message)));
  };
  for (const char* key : {"run", "slcmap", "sequence", "stamps_moved_ns", "position_m", "yaw_rad",
                          "first_pose_ns", "last_pose_ns"}) {
    Json json = good;
    json["merged"][1].erase(key);
    expect_refused(json, std::string(key) + ": missing");
  }
  Json json = good;
  json["merged"][1] = 7;
  expect_refused(json, "found a value of a wrong type");
  // A pose between those of the two runs.
  json = good;
  json["merged"][0]["last_pose_ns"] = first_ns + 1'950'000'000;
  expect_refused(json, "merged: found a pose at " + std::to_string(first_ns + 2'000'000'000) +
                           " ns that is none of any run's");
}

}  // namespace
}  // namespace slcmap
