#include "mapping/align/merge_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>

#include "data/core/error.h"
#include "mapping/align/surface_union.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/geometry/pinhole.h"
#include "tests/mapping/align/made_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScannedMap;
using ::testing::SizeIs;
using testing::TwoRoomFlat;

// The west room, and from the east one through the door into it.
MapResult West() { return ScannedMap(TwoRoomFlat(), testing::kWestWay); }

const RigidTransform kEastWorld = LevelTransform(1.9, {3, -2, 0.4});

MapResult East(int64_t first_ns = 1'000'000'000) {
  return ScannedMap(TwoRoomFlat(), testing::kWholeWay, kEastWorld, "b", first_ns);
}

MapResult Merge(MapResult first, MapResult second) {
  return MergeMaps({{[&] { return std::move(first); }, {}},
                    {[&] { return std::move(second); }, kEastWorld.Inverse()}},
                   MappingOptions());
}

// Of both, made once.
class MergedMaps : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ = std::make_unique<MapResult>(West());
    both_ = std::make_unique<MapResult>(Merge(West(), East()));
  }
  static void TearDownTestSuite() {
    first_.reset();
    both_.reset();
  }
  static inline std::unique_ptr<MapResult> first_, both_;
};

TEST_F(MergedMaps, TheRoomsOfBothAreRoomsOfOneBuilding) {
  EXPECT_THAT(both_->building.rooms, SizeIs(2));
}

TEST_F(MergedMaps, StampsThatBothHaveAreMovedByAnHour) {
  const Trajectory& trajectory = both_->trajectory;
  ASSERT_THAT(trajectory,
              SizeIs(first_->trajectory.size() + testing::PlacesAlong(testing::kWholeWay).size()));
  for (size_t i = 1; i < trajectory.size(); ++i) {
    EXPECT_LT(trajectory[i - 1].stamp_ns, trajectory[i].stamp_ns);
  }
  ASSERT_THAT(both_->source.merged, SizeIs(2));
  EXPECT_EQ(both_->source.merged[0].stamps_moved_ns, 0);
  EXPECT_EQ(both_->source.merged[1].stamps_moved_ns, 3600'000'000'000);
}

TEST_F(MergedMaps, SurfacesThatBothSawAreOne) {
  // In the west room, where the second saw most of the same.
  const auto west_of = [](const MapResult& m) {
    return std::ranges::count_if(m.dense, [](const DensePoint& p) { return p.p_world.x() < 4.9; });
  };
  EXPECT_LT(static_cast<double>(west_of(*both_)), 1.35 * static_cast<double>(west_of(*first_)));
  EXPECT_GE(west_of(*both_), west_of(*first_));
}

TEST_F(MergedMaps, WhatEitherKnowsOfSpaceIsKnown) {
  const Vector3d in_east(7, 2, 1.5), in_west(2, 2, 1.5), in_wall(9.02, 2.45, 1.25);
  EXPECT_FALSE(first_->occupancy.IsFree(in_east + Vector3d(0, 1.6, 0)));
  EXPECT_TRUE(both_->occupancy.IsFree(in_east));
  EXPECT_TRUE(both_->occupancy.IsFree(in_west));
  EXPECT_FALSE(both_->occupancy.IsFree(in_wall));
}

TEST_F(MergedMaps, ComeBackFromTheirFolderAndTheSameMapsGiveTheSameBytes) {
  const testing::TempFolder folder;
  const std::string id = WriteMapFolder(folder.Path("a"), *both_);
  EXPECT_EQ(WriteMapFolder(folder.Path("b"), Merge(West(), East())), id);
  const MapResult map = ReadMapFolder(folder.Path("a"));
  ASSERT_THAT(map.source.merged, SizeIs(2));
  EXPECT_EQ(map.source.merged[1].run_id, "b");
  // Each pose is of one of them, and the recordings' stamps are known.
  ASSERT_TRUE(map.source.merged[0].poses_ns && map.source.merged[1].poses_ns);
  EXPECT_EQ(map.source.merged[0].poses_ns->from_ns, map.trajectory.front().stamp_ns);
  EXPECT_EQ(map.source.merged[0].poses_ns->to_ns, first_->trajectory.back().stamp_ns);
  EXPECT_EQ(map.source.merged[1].poses_ns->to_ns, map.trajectory.back().stamp_ns);
  EXPECT_EQ(map.source.merged[1].poses_ns->from_ns - map.source.merged[1].stamps_moved_ns,
            1'000'000'000);
  EXPECT_LT((map.source.merged[1].T_world_run * Vector3d(3, -2, 0.4)).norm(), 0.02);
  EXPECT_THAT(CollectRuns(map), ElementsAre("a", "b"));
}

TEST_F(MergedMaps, NamesOfRoomsAreKeptWhereManyPlacedMapsAreMerged) {
  const testing::TempFolder folder;
  WriteMapFolder(folder.Path(), *both_);
  MapResult named = ReadMapFolder(folder.Path());
  named.building.name = "House";
  std::map<std::string, double> areas_m2;
  for (Room& room : named.building.rooms) {
    room.name = "room " + std::to_string(room.id);
    areas_m2[room.name] = room.area_m2;
  }
  const RigidTransform T_world_other = LevelTransform(0.3, {1, 2, 0});
  const auto scan = [&](double x_m, const char* run) {
    return [=] {
      return ScannedMap(TwoRoomFlat(), {{x_m, 2, 1.5}, {x_m + 1, 2.4, 1.5}},
                        T_world_other.Inverse(), run);
    };
  };
  // The one with names is not the world's.
  const MapResult map = MergeMaps({{scan(2, "c"), {}},
                                   {scan(6, "d"), {}},
                                   {[&] { return std::move(named); }, T_world_other.Inverse()}},
                                  MappingOptions());
  ASSERT_THAT(map.building.rooms, SizeIs(2));
  EXPECT_EQ(map.building.name, "House");
  for (const Room& room : map.building.rooms) {
    ASSERT_TRUE(areas_m2.contains(room.name)) << room.name;
    EXPECT_NEAR(room.area_m2, areas_m2.at(room.name), 1);
  }
}

MapLine Joint(int course) {
  MapLine joint;
  joint.id = 1000 + course;
  joint.axis = LineAxis::kX;
  joint.world = 0;
  joint.start_world = {1, 0, 0.4 + 0.075 * course};
  joint.end_world = {3, 0, 0.4 + 0.075 * course};
  joint.observations = 5;
  joint.edge_probability = 0.2;
  return joint;
}

// Two that have what has to be told of, or to be made anew, for the merged one.
TEST(MergeMaps, OfPartialMapsOfOneRecordingAPartialOneIsMade) {
  constexpr int kJoints = 20;
  MapResult first = West(), second = East();
  first.warnings["imu_gaps"] = 1;
  second.warnings["imu_gaps"] = 2;
  second.complete = false;
  second.partial_reason = "interrupted";
  second.verdict.emplace().Add({VerdictLevel::kDoubtful, "x", "1", "2", "3"});
  first.source.sequence = second.source.sequence = "/recordings/rooms";
  first.source.georeference = Georeference{"EPSG:25832", {691607, 5334760, 515}};
  second.source.georeference = first.source.georeference;  // the worlds of the maps are apart
  second.filled.push_back({{0.5, 0.5, 40}, Vector3d::UnitZ(), 0.01, 100});
  for (int course = 0; course < kJoints; ++course) first.marks.push_back(Joint(course));
  for (MapResult* map : {&first, &second}) {  // where walls meet the ceiling no line is known
    double top_m = -1e9;
    for (const MapLine& line : map->lines) top_m = std::max(top_m, line.start_world.z());
    std::erase_if(map->lines, [&](const MapLine& line) {
      return std::min(line.start_world.z(), line.end_world.z()) > top_m - 0.1;
    });
  }
  MapLine old = second.lines.front();  // a junction
  old.id = 100000;
  old.segment += 1;  // which is of no matter
  old.observations = 0;
  old.start_world.z() = old.end_world.z() = 40;
  second.lines.push_back(old);
  const MapResult map = Merge(std::move(first), std::move(second));

  EXPECT_FALSE(map.complete);
  EXPECT_THAT(map.partial_reason, HasSubstr("run b: interrupted"));
  EXPECT_EQ(map.warnings.at("imu_gaps"), 3);
  ASSERT_TRUE(map.verdict.has_value());
  EXPECT_EQ(map.verdict->level, VerdictLevel::kDoubtful);
  EXPECT_EQ(map.warnings.at("recordings_merged_twice"), 1);
  EXPECT_EQ(map.warnings.at("places_on_earth_differ"), 1);
  EXPECT_EQ(map.source.georeference->origin_m.x(), 691607);
  // Filled anew, by what both have measured.
  for (std::size_t i = 0; i < CountDense(map); ++i) ASSERT_LT(DenseAt(map, i).p_world.z(), 30);
  // What a pattern says of its marks is in their probabilities already.
  ASSERT_THAT(map.patterns, SizeIs(1));
  EXPECT_NEAR(map.patterns[0].spacing_m, 0.075, 0.001);
  EXPECT_THAT(map.patterns[0].line_ids, SizeIs(kJoints));
  ASSERT_THAT(map.marks, SizeIs(kJoints));
  for (const MapLine& mark : map.marks) EXPECT_NEAR(mark.edge_probability, 0.2, 1e-9);
  // Junctions of the building of both.
  ASSERT_FALSE(map.building.storeys.empty());
  ASSERT_TRUE(map.building.storeys.front().ceiling_m);
  double at_ceiling_m = 0;
  for (const MapLine& line : map.lines) {
    ASSERT_LT(line.start_world.z(), 30);
    const bool is_there =
        std::abs(line.start_world.z() - *map.building.storeys.front().ceiling_m) < 0.03;
    if (IsJunction(line) && is_there) at_ceiling_m += (line.end_world - line.start_world).norm();
  }
  EXPECT_GT(at_ceiling_m, 10);
}

// A point that a keyframe's left camera sees.
void SeePoint(size_t keyframe, const Vector3d& p_map, MapResult* map) {
  const Rig& rig = map->rectified_rig;
  const StampedPose& pose = map->keyframes[keyframe];
  const Vector3d p_world = pose.T_world_imu * rig.T_imu_camera[0] * p_map;
  map->points.push_back({p_world, 0.01, 3, {}});
  map->point_observations.push_back({std::ssize(map->points) - 1, 0, pose.stamp_ns, 0,
                                     PixelFromPlane(rig.cameras[0], p_map.hnormalized().eval())});
}

TEST(MergeMaps, PointsKeepTheImagesThatSawThem) {
  MapResult first = West(), second = East();
  SeePoint(2, {0.5, -0.2, 2}, &first);
  SeePoint(1, {-0.3, 0.1, 1.5}, &second);
  SeePoint(4, {-0.2, 0.4, 2.5}, &second);
  second.rectified_rig.cameras[0].fx_px += 3;  // calibrated a little otherwise
  second.rectified_rig.cameras[0].fy_px += 3;
  const int64_t stamp_ns = second.keyframes[4].stamp_ns + 3600'000'000'000;
  const MapResult map = Merge(std::move(first), std::move(second));
  ASSERT_THAT(map.points, SizeIs(3));
  ASSERT_THAT(map.point_observations, SizeIs(3));
  int64_t found = 0;
  for (const MapPointObservation& seen : map.point_observations) {
    const auto pose = std::ranges::find(map.keyframes, seen.stamp_ns, &StampedPose::stamp_ns);
    ASSERT_NE(pose, map.keyframes.end());
    found += seen.stamp_ns == stamp_ns ? 1 : 0;
    const RigidTransform T_world_camera = pose->T_world_imu * map.rectified_rig.T_imu_camera[0];
    const Vector3d p_camera =
        T_world_camera.Inverse() * map.points[static_cast<size_t>(seen.point)].p_world;
    const Eigen::Vector2d px =
        PixelFromPlane(map.rectified_rig.cameras[0], p_camera.hnormalized().eval());
    EXPECT_LT((px - seen.px).norm(), 1.5) << seen.point;
  }
  EXPECT_EQ(found, 1);
}

TEST(MergeMaps, KeyframesOfOtherCamerasAreLeftOutAndStampsOfAnotherTimeStay) {
  MapResult other = East(-9'000'000'000);
  other.rectified_rig.T_imu_camera[1].translation.y() = -0.3;
  SeePoint(0, {0, 0, 2}, &other);
  const size_t keyframes = other.keyframes.size();
  const MapResult map = Merge(West(), std::move(other));
  EXPECT_THAT(map.keyframes, SizeIs(West().keyframes.size()));
  EXPECT_EQ(map.warnings.at(kKeyframesOfOtherCameras), static_cast<int64_t>(keyframes));
  EXPECT_THAT(map.points, SizeIs(1));
  EXPECT_TRUE(map.point_observations.empty());
  EXPECT_EQ(map.source.merged[1].stamps_moved_ns, 0);
  EXPECT_EQ(map.trajectory.front().stamp_ns, -9'000'000'000);
}

TEST(MergeMaps, MapsThatCannotBeMergedAreRefused) {
  const auto why_not = [](MapResult second) {
    return testing::MessageOf<DataError>([&] { Merge(West(), std::move(second)); });
  };
  EXPECT_THAT(why_not(West()), HasSubstr("found run a in both maps"));
  MapResult sparse = East(), lost = East(), without_lines_behind = East(), pointed = East();
  sparse.dense.clear();
  EXPECT_THAT(why_not(std::move(sparse)), HasSubstr("--sparse"));
  lost.lines.back().segment = 1;
  EXPECT_THAT(why_not(std::move(lost)), HasSubstr("several segments"));
  without_lines_behind.verdict.emplace().Add(
      {VerdictLevel::kDoubtful, kLostReason, "once", "never", "none"});
  EXPECT_THAT(why_not(std::move(without_lines_behind)), HasSubstr("several segments"));
  pointed.lines.back().end_world = pointed.lines.back().start_world;
  EXPECT_THAT(why_not(std::move(pointed)), HasSubstr("ends where it starts"));
}

TEST(UniteSurfaces, TheSidesOfAThinWallStayTwo) {
  const DensePoint front{{0, 0, 1.01}, Vector3d::UnitZ(), 0.005, 100};
  const DensePoint back{{0, 0, 1.04}, -Vector3d::UnitZ(), 0.005, 100};
  EXPECT_THAT(UniteSurfaces({front, back}, {front, back}, 0.05), SizeIs(2));
}

// A surface on the border of two voxels, a little off in the second map.
TEST(UniteSurfaces, OneSurfaceInTwoVoxelsIsOnePoint) {
  const DensePoint below{{0.02, 0.02, 0.999}, Vector3d::UnitZ(), 0.004, 100};
  const DensePoint above{{0.02, 0.02, 1.001}, Vector3d::UnitZ(), 0.006, 100};
  const std::vector<DensePoint> united = UniteSurfaces({below}, {above}, 0.05);
  ASSERT_THAT(united, SizeIs(1));
  EXPECT_DOUBLE_EQ(united[0].p_world.z(), 0.999);
}

TEST(UniteSurfaces, PointsOfOneVoxelAreWeightedByWhatIsKnown) {
  const DensePoint good{{0.01, 0.01, 0.01}, Vector3d::UnitZ(), 0.01, 100};
  const DensePoint poor{{0.01, 0.01, 0.04}, Vector3d::UnitZ(), 0.02, 200};
  const std::vector<DensePoint> united = UniteSurfaces({good}, {poor}, 0.05);
  ASSERT_THAT(united, SizeIs(1));
  EXPECT_NEAR(united[0].p_world.z(), 0.016, 1e-6);
  EXPECT_EQ(united[0].grey, 120);
}

TEST(UnitePoints, TracksOfPointsThatBecomeOneStayApart) {
  const auto near = [](double x) { return MapPoint{{x, 0.01, 0.01}, 0.01, 3, {}}; };
  const Eigen::Vector2d px(1, 2);
  const UnitedPoints first{
      {near(0.21), near(0.01)},
      {{0, 0, 5, 0, px}, {1, 0, 5, 0, px}, {1, 1, 5, 0, px}, {1, 1, 6, 1, px}}};
  const UnitedPoints second{{near(0.02), near(0.03), near(0.41)},
                            {{0, 0, 8, 0, px}, {1, 0, 8, 0, px}, {2, 0, 8, 0, px}}};
  const UnitedPoints united = UnitePoints(first, second, 0.1);
  ASSERT_THAT(united.points, SizeIs(3));
  EXPECT_EQ(united.points[0].observations, 9);
  std::vector<std::tuple<int64_t, int, int64_t, int>> keys;
  for (const MapPointObservation& seen : united.observations) keys.push_back(MakeKey(seen));
  using Key = std::tuple<int64_t, int, int64_t, int>;
  EXPECT_THAT(keys, ElementsAre(Key(0, 0, 5, 0), Key(0, 1, 5, 0), Key(0, 1, 6, 1), Key(0, 2, 8, 0),
                                Key(0, 3, 8, 0), Key(1, 0, 5, 0), Key(2, 0, 8, 0)));
}

// One free leaf that is an eighth of the tree's world.
TEST(UniteOccupancy, SpaceThatNoBuildingHasIsRefused) {
  const testing::TempFolder folder;
  const std::string path = folder.Write(
      "huge.bt", std::string("# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.1\ndata\n") +
                     std::string("\x02\x00", 2));
  EXPECT_THROW(UniteOccupancy(OccupancyMap(0.1), OccupancyMap::Read(path), {}, {}, 0.05),
               DataError);
}

TEST(UniteOccupancy, OccupiedFreeAndUnknownAreUnited) {
  OccupancyMap first(0.1), second(0.1);
  first.Mark({{{1, 1, 1}, {2, 1, 1}}, {{5, 1, 1}}});
  // In a world that lies 1 m farther along x.
  second.Mark({{{-5, 1, 1}, {-7, 1, 1}}, {{-9, 1, 1}}});
  const RigidTransform T = LevelTransform(0, {1, 0, 0});
  const OccupancyMap united =
      UniteOccupancy(first, second, T, {{{0.75, 0.15, 0.15}, Vector3d::UnitZ(), 0.01, 0}}, 0.05);
  const auto at = [](int x) { return Vector3d(0.1 * x + 0.05, 0.15, 0.15); };
  EXPECT_TRUE(united.IsFree(at(2)));
  EXPECT_TRUE(united.IsFree(at(1)));      // free in one, occupied in the other, and no point there
  EXPECT_TRUE(united.IsFree(at(5)));      // the same
  EXPECT_TRUE(united.IsFree(at(3)));      // of the second alone
  EXPECT_TRUE(united.IsOccupied(at(7)));  // by a point
  EXPECT_FALSE(united.IsFree(at(8)) || united.IsOccupied(at(8)));
}

}  // namespace
}  // namespace slcmap
