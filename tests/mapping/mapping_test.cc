#include "mapping/mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "mapping/map/map_folder.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::MessageOf;

OdometryRun MakeEmptyRun() {
  OdometryRun run = testing::MakeWallRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
  return run;
}

// Made once.
const MapResult& WallMap() {
  static const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  return map;
}

class MappingTest : public ::testing::Test {
 protected:
  // Reading must fail with a message that holds this.
  void ExpectReadError(const std::string& what, bool accept_changed = false) const {
    EXPECT_THAT(
        MessageOf<DataError>([&] { ReadMapFolder(folder_, {.accept_changed = accept_changed}); }),
        HasSubstr(what));
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/map");
};

TEST_F(MappingTest, AWallBecomesPointsAndVoxels) {
  MappingOptions options;
  options.occupancy.resolution_m = 0.1;
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, options);
  EXPECT_TRUE(map.complete);
  EXPECT_EQ(map.trajectory.size(), 51u);
  EXPECT_EQ(map.keyframes.size(), 6u);
  EXPECT_GT(map.points.size(), 380u);
  for (const MapPoint& point : map.points) EXPECT_NEAR(point.p_world.x(), 10.02, 1e-12);
  EXPECT_GT(map.occupancy.OccupiedVoxels().size(), 300u);
  for (const Voxel& voxel : map.occupancy.OccupiedVoxels()) {
    EXPECT_NEAR(voxel.centre_world.x(), 10.05, 1e-5);
  }
  EXPECT_TRUE(map.occupancy.IsFree({7.05, 0.05, 1.05}));
}

// The run reports all lines that it has estimated: which become lines of the map is for mapping.
TEST_F(MappingTest, CertainLinesBecomeLinesOfTheMap) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[0].covariance_m2 *= 100;                  // 4 cm
  run.lines[1].end_world = run.lines[1].start_world;  // no extent
  run.lines[2].observations = 3;                      // seen too seldom
  run.lines[3].covariance_m2.setConstant(std::nan(""));
  const std::vector<MapLine> lines = MapRun(run, nullptr, {}).lines;
  ASSERT_EQ(lines.size(), 20u);
  EXPECT_EQ(lines[0].id, 104);
  EXPECT_EQ(lines[0].axis, LineAxis::kVertical);
  EXPECT_EQ(lines[19].axis, LineAxis::kY);
  EXPECT_EQ(lines[19].world, 0);
  EXPECT_NEAR(lines[19].sigma_m, 0.004, 1e-9);
  EXPECT_EQ(lines[19].observations, run.lines[23].observations);
  EXPECT_EQ(lines[19].end_world, run.lines[23].end_world);
  MappingOptions options;
  options.run_lines = {.max_sigma_m = 0.05, .min_observations = 3};
  EXPECT_EQ(MapRun(run, nullptr, options).lines.size(), 22u);
}

TEST_F(MappingTest, AnEmptyRunMakesAnEmptyMapThatComesBackWithAllCounts) {
  WriteMapFolder(folder_, MapRun(MakeEmptyRun(), nullptr, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_TRUE(map.trajectory.empty() && map.keyframes.empty() && map.points.empty());
  EXPECT_TRUE(map.lines.empty() && map.occupancy.OccupiedVoxels().empty());
  const std::string path = folder_ + "/map.json";
  const Json good = Json::parse(ReadFile(path));
  for (const auto& [what, count] : good.at("counts").items()) {
    ASSERT_EQ(count, 0) << what;
    Json json = good;
    json["counts"].erase(what);
    json.erase("id");
    json.erase("checksum");
    WriteSummaryFile(path, json);
    ExpectReadError("map.json: " + what + ": missing");
  }
}

TEST_F(MappingTest, APartialRunMakesAPartialMap) {
  OdometryRun run = testing::MakeWallRun();
  run.complete = false;
  run.partial_reason = "interrupted";
  run.warnings["imu_gap"] = 3;
  run.landmarks[5].p_world.x() = std::numeric_limits<double>::quiet_NaN();
  // On another clock than its states, of which none is refined then: once silently.
  for (Keyframe& keyframe : run.keyframes) keyframe.stamp_ns += 20'000'000;
  WriteMapFolder(folder_, MapRun(run, nullptr, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "interrupted");
  ASSERT_EQ(map.warnings.size(), 2u);
  EXPECT_EQ(map.warnings.at("imu_gap"), 3);
  EXPECT_THAT(map.warnings.rbegin()->first, HasSubstr("poses not refined"));
  EXPECT_EQ(map.warnings.rbegin()->second, std::ssize(run.states));
  EXPECT_GT(map.points.size(), 370u);
}

TEST_F(MappingTest, ReportsHowFarItIsAndOnceItIsEndedHoldsWhatIsDone) {
  std::vector<double> shares;
  const MapResult map = MapRun(testing::MakeLineRun(), nullptr, {}, {}, Progress([&](double done) {
                                 shares.push_back(done);
                                 return done < 0.75;
                               }));
  EXPECT_GT(shares.size(), 5u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0);
  EXPECT_LE(shares.back(), 1);
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "mapping was interrupted before the occupancy");
  EXPECT_EQ(map.trajectory.size(), 51u);
  EXPECT_GT(map.points.size(), 380u);
  EXPECT_EQ(map.lines.size(), 24u);
  EXPECT_TRUE(map.occupancy.IsFree({7.05, 0.05, 1.05}));  // as the first keyframes saw
}

TEST_F(MappingTest, TheSameRunGivesTheSameBytesAndOtherOptionsAnotherId) {
  const std::string id = WriteMapFolder(folder_, WallMap());
  MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  EXPECT_EQ(WriteMapFolder(temp_.Path("b"), map), id);  // which is of all files
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::string name = entry.path().filename();
    EXPECT_EQ(ReadFile(folder_ + "/" + name), ReadFile(temp_.Path("b/" + name))) << name;
  }
  map.source.options += "# otherwise\n";
  EXPECT_NE(WriteMapFolder(temp_.Path("b"), map), id);
}

TEST_F(MappingTest, AFullDiskNamesTheFileAndLeavesTheOldMap) {
  WriteMapFolder(folder_, MapRun(MakeEmptyRun(), nullptr, {}));
  {
    const testing::FileSizeLimit full(500);
    EXPECT_THAT(MessageOf<OutputError>([&] { WriteMapFolder(folder_, WallMap()); }),
                HasSubstr("trajectory.tum: cannot be written"));
  }
  EXPECT_TRUE(ReadMapFolder(folder_).trajectory.empty());
}

// What the run does not know of a line's direction is not made up.
TEST_F(MappingTest, LinesOfUnknownDirectionHaveNoCovariance) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[2].deviation_sigma_rad = kUnknownSigma_rad;
  run.lines[3].axis = LineAxis::kNone;
  run.lines[4].deviation_sigma_rad = 0.01;
  run.lines[5].deviation_sigma_rad = 9e8;
  run.lines[6].covariance_m2(0, 0) = -1e-5;
  const LineEvidence evidence = MapRun(run, nullptr, {}).line_evidence;
  ASSERT_EQ(evidence.covariances.size(), 20u);
  const LineCovariance& turning = evidence.covariances[2];
  EXPECT_EQ(turning.line_id, 104);
  const double half_m = 0.5 * (run.lines[4].end_world - run.lines[4].start_world).norm();
  EXPECT_NEAR(turning.end_m2(0, 0), run.lines[4].covariance_m2(0, 0) + 1e-4 * half_m * half_m,
              1e-9);
  EXPECT_NEAR(turning.end_m2(2, 2), 0, 1e-12);  // it is vertical
}

using PointObservations = MappingTest;

// Where the map's rig sees a point.
Eigen::Vector2d DistortToPixel(const MapResult& map, const MapPointObservation& seen) {
  const Rig& rig = map.rectified_rig;
  for (const StampedPose& pose : map.keyframes) {
    if (pose.stamp_ns != seen.stamp_ns) continue;
    const RigidTransform T_world_camera = pose.T_world_imu * rig.T_imu_camera[seen.camera];
    return *rig.cameras[seen.camera].Project(T_world_camera.Inverse() *
                                             map.points[seen.point].p_world);
  }
  ADD_FAILURE() << "no keyframe";
  return Eigen::Vector2d::Zero();
}

TEST_F(PointObservations, SayWhereEachImageShowsAPoint) {
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
TEST_F(PointObservations, LandmarksThatBecameOnePointAreTracksOfIt) {
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
TEST_F(PointObservations, FollowWhatWasFoundOfTheCameras) {
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
    for (KeyframeObservation& seen : keyframe.observations) {
      const auto px = [&](int camera) {
        return *true_rig.cameras[camera].Project(
            (keyframe.T_world_imu * true_rig.T_imu_camera[camera]).Inverse() *
            run.landmarks[static_cast<size_t>(seen.landmark_id)].p_world);
      };
      seen.left_px = px(0);
      seen.right_px = px(1);
    }
  }
  const MapResult map = MapRun(run, nullptr, {});
  ASSERT_FALSE(map.point_observations.empty());
  for (const MapPointObservation& seen : map.point_observations) {
    EXPECT_LT((DistortToPixel(map, seen) - seen.px).norm(), 0.01);
  }
}

// As of a run that was cut off.
TEST_F(PointObservations, TracksOfAPointCountFromZeroWhateverWasSeen) {
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
TEST_F(PointObservations, AreFinite) {
  OdometryRun run = testing::MakeWallRun();
  run.keyframes[0].observations[3].left_px.x() = std::nan("");
  run.keyframes[1].observations[3].right_px->y() = 1e9;
  const MapResult map = MapRun(run, nullptr, {});
  WriteMapFolder(folder_, map);
  EXPECT_EQ(ReadMapFolder(folder_).point_observations.size(),
            MapRun(testing::MakeWallRun(), nullptr, {}).point_observations.size() - 2);
}

}  // namespace
}  // namespace slcmap
