#include "mapping/align/map_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mapping/align/map_agreement.h"
#include "mapping/mapping.h"
#include "tests/mapping/align/made_scenes.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using testing::ScannedMap;
using ::testing::SizeIs;

Scene Room(const std::string& things) {
  return testing::SceneFromText("objects:\n" + testing::Slabs(0, 0, 7, 4) + R"(
  - {kind: wall, points: [[0, 0], [7, 0], [7, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: box, at: [0.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
)" + things);
}

const char kCupboard[] = "  - {kind: box, at: [3.2, 0.5, 0], size: [1.2, 0.6, 1.9]}\n";
const char kTable[] = "  - {kind: box, at: [5.6, 2.4, 0], size: [0.8, 1.2, 0.75]}\n";

const RigidTransform kLaterWorld = LevelTransform(0.4, {1, -2, 0.3});

MapResult Earlier() {
  return ScannedMap(Room(kCupboard), {{1.2, 2, 1.5}, {4.5, 2.2, 1.5}, {6, 1.6, 1.5}});
}
MapResult Later() {
  return ScannedMap(Room(kTable), {{6, 1.4, 1.5}, {3, 2.4, 1.5}, {1.4, 1.8, 1.5}}, kLaterWorld,
                    "b");
}

TEST(MapChanges, WhatWentAndWhatCameIsTold) {
  const ComparableMap earlier(Earlier()), later(Later());
  const std::vector<MapChange> changes =
      FindChanges(earlier.Get(), later.Get(), kLaterWorld.Inverse());
  ASSERT_THAT(changes, SizeIs(2));
  const auto middle = [](const MapChange& change) -> Vector3d {
    return 0.5 * (change.least_world + change.most_world);
  };
  const MapChange &cupboard = changes[changes[0].is_new ? 1 : 0],
                  &table = changes[changes[0].is_new ? 0 : 1];
  EXPECT_FALSE(cupboard.is_new);
  EXPECT_LT((middle(cupboard) - Vector3d(3.2, 0.5, 0.95)).norm(), 0.4);
  EXPECT_TRUE(table.is_new);
  EXPECT_LT((middle(table).head<2>() - Eigen::Vector2d(5.6, 2.4)).norm(), 0.3);
  EXPECT_FALSE(cupboard.is_wall);
  EXPECT_TRUE(FindChanges(earlier.Get(), earlier.Get(), {}).empty());
}

std::ptrdiff_t PointsOfCupboard(const MapResult& map) {
  return std::ranges::count_if(map.dense, [](const DensePoint& point) {
    const Vector3d& p = point.p_world;
    return std::abs(p.x() - 3.2) < 0.65 && std::abs(p.y() - 0.5) < 0.35 && p.z() > 0.2 && p.z() < 2;
  });
}

MapResult Merged(const std::string& first_date, const std::string& second_date) {
  const std::vector<MapToMerge> maps = {{Earlier, {}, first_date},
                                        {Later, kLaterWorld.Inverse(), second_date}};
  return MergeMaps(maps, MappingOptions());
}

TEST(MapChanges, WhatALaterWalkSawToBeGoneIsNotInTheMergedMap) {
  const MapResult updated = Merged("2026-01-05", "2026-03-01");
  const MapResult undated = Merged("", "");
  EXPECT_GT(PointsOfCupboard(undated), 300);
  EXPECT_LT(PointsOfCupboard(updated), PointsOfCupboard(undated) / 10);
  // Of the later one nothing is taken.
  EXPECT_GT(PointsOfCupboard(Merged("2026-03-01", "2026-01-05")), 300);
  ASSERT_THAT(updated.source.merged, SizeIs(2));
  EXPECT_EQ(updated.source.merged[1].date, "2026-03-01");
  EXPECT_TRUE(updated.occupancy.IsFree({3.2, 0.5, 1.2}));
}

}  // namespace
}  // namespace slcmap
