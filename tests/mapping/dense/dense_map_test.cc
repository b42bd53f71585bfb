// A room of known walls, from its images: what is mapped lies on them, and covers them.
#include "mapping/dense/dense_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "data/core/error.h"
#include "mapping/map/part_files.h"
#include "tests/testing/room_views.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

DenseOptions SmallOptions() {
  DenseOptions options;
  options.grid_px = 4;
  options.min_travel_m = 0.05;
  options.threads = 1;
  return options;
}

bool AreEqual(const std::vector<DensePoint>& a, const std::vector<DensePoint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const DensePoint& p, const DensePoint& q) {
                      return p.p_world == q.p_world && p.normal_world == q.normal_world &&
                             p.sigma_m == q.sigma_m && p.grey == q.grey && p.source == q.source;
                    });
}

TEST(DenseMap, LiesOnTheWallsOfARoom) {
  const RoomViews room(3, 0.25, 1.5);
  const DenseMap map = BuildDense(room.views(), room, SmallOptions());
  EXPECT_EQ(map.views_without_images, 0);
  ASSERT_GT(map.points.size(), 3000u);
  int64_t near = 0, inward = 0;
  for (const DensePoint& point : map.points) {
    near += room.DistanceFromWalls_m(point.p_world) < 0.05;
    EXPECT_NEAR(point.normal_world.norm(), 1, 1e-9);
    inward += point.normal_world.dot(room.room().center() - point.p_world) > 0;
  }
  const auto count = static_cast<double>(map.points.size());
  EXPECT_GT(static_cast<double>(near), 0.97 * count);
  EXPECT_GT(static_cast<double>(inward), 0.999 * count);  // in corners a patch may see two walls
}

TEST(DenseMap, IsTheSameOnAnyNumberOfThreads) {
  const RoomViews room(3, 0.25, 1.5);
  DenseOptions options = SmallOptions();
  const DenseMap one = BuildDense(room.views(), room, options);
  options.threads = 3;
  const DenseMap three = BuildDense(room.views(), room, options);
  ASSERT_FALSE(one.points.empty());
  EXPECT_TRUE(AreEqual(one.points, three.points));
}

TEST(DenseMap, SurvivesAViewWithoutImages) {
  RoomViews room(3, 0.25, 1.5);
  room.Lose(5);
  const DenseMap map = BuildDense(room.views(), room, SmallOptions());
  EXPECT_EQ(map.views_without_images, 1);
  EXPECT_FALSE(map.points.empty());
}

TEST(DenseMap, EndsWhenAskedWithWhatIsDone) {
  const RoomViews room(4, 0.1, 1.5);
  const DenseMap none =
      BuildDense(room.views(), room, SmallOptions(), Progress([](double) { return false; }));
  EXPECT_TRUE(none.points.empty());
  EXPECT_EQ(none.views, 0);
}

TEST(DenseMap, OfNoViewsIsEmpty) {
  const RoomViews room(3, 0.25, 1.5);
  EXPECT_TRUE(BuildDense({}, room, SmallOptions()).points.empty());
}

TEST(DenseOptions, RefusesValuesOutOfTheirRange) {
  DenseOptions options;
  options.voxel_m = 0;
  EXPECT_THROW(options.Check(), ConfigError);
  options = DenseOptions();
  options.min_depth_m = 5;
  options.max_depth_m = 2;
  EXPECT_THROW(options.Check(), ConfigError);
}

TEST(DenseFile, GivesBackWhatWasWritten) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("dense.ply");
  DensePoint filled{{1.5, -2.25, 0.5}, {0, 0, -1}, 0.0078125, 200, DenseSource::kFilledPlane};
  DensePoint seen{{-3, 2, 1}, {1, 0, 0}, 0.015625, 7, DenseSource::kStereo};
  WriteDensePly(path, {filled, seen});
  EXPECT_TRUE(AreEqual(ReadDensePly(path), {filled, seen}));
  WriteDensePly(path, {});
  EXPECT_TRUE(ReadDensePly(path).empty());
}

// Viewers show a cloud in colour by these names alone.
TEST(DenseFile, IsColouredByItsGrey) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("dense.ply");
  WriteDensePly(path, {{{1, 2, 3}, {0, 0, 1}, 0.01, 77, DenseSource::kStereo}});
  const PlyElement vertices = ReadPly(path).Get("vertex", path);
  for (const char* name : {"red", "green", "blue", "grey"}) {
    EXPECT_EQ(vertices.Get(name, path).values.at(0), 77) << name;
  }
}

TEST(DenseFile, RefusesASourceThatIsNone) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("dense.ply");
  DensePoint point;
  point.source = static_cast<DenseSource>(5);
  WriteDensePly(path, {point});
  EXPECT_THROW(ReadDensePly(path), DataError);
}

}  // namespace
}  // namespace slcmap
