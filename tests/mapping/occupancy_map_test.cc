#include "mapping/occupancy_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "data/error.h"
#include "data/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

const testing::TempFolder kFolder;
const std::string kPath = kFolder.Path("a.bt");

OccupancyMap MakeMap() {
  OccupancyMap map(0.1);
  map.Insert({{{0.05, 0.05, 0.05}, {{3.05, 0.05, 0.05}, {0.05, 30.05, 0.05}}}}, 5);
  return map;
}

void ExpectRays(const OccupancyMap& map) {
  EXPECT_TRUE(map.IsOccupied({3.05, 0.05, 0.05}));
  EXPECT_TRUE(map.IsFree({2.05, 0.05, 0.05}));
  EXPECT_FALSE(map.IsFree({3.15, 0.05, 0.05}));  // behind the point: unknown
  EXPECT_FALSE(map.IsOccupied({3.15, 0.05, 0.05}));
  EXPECT_TRUE(map.IsFree({0.05, 4.55, 0.05}));  // towards a point beyond the range
  EXPECT_FALSE(map.IsFree({0.05, 6.05, 0.05}));
  EXPECT_FALSE(map.IsOccupied({0.05, 30.05, 0.05}));
  const std::vector<Voxel> voxels = map.OccupiedVoxels();
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_LT((voxels[0].centre_world - Eigen::Vector3d(3.05, 0.05, 0.05)).norm(), 1e-6);
  EXPECT_NEAR(voxels[0].size_m, 0.1, 1e-9);
}

TEST(OccupancyMap, RaysMakeSpaceFreeAndTheirEndsOccupied) { ExpectRays(MakeMap()); }

TEST(OccupancyMap, ComesBackFromItsFile) {
  MakeMap().Write(kPath);
  const OccupancyMap map = OccupancyMap::Read(kPath);
  EXPECT_NEAR(map.resolution_m(), 0.1, 1e-9);
  ExpectRays(map);
}

// OctoMap's own reader, which the header is written for.
TEST(OccupancyMap, OctomapReadsTheFile) {
  MakeMap().Write(kPath);
  octomap::OcTree tree(1);
  ASSERT_TRUE(tree.readBinary(kPath));
  EXPECT_NEAR(tree.getResolution(), 0.1, 1e-9);
  const octomap::OcTreeNode* node = tree.search(3.05, 0.05, 0.05);
  ASSERT_NE(node, nullptr);
  EXPECT_TRUE(tree.isNodeOccupied(node));
}

TEST(OccupancyMap, TheSameRaysGiveTheSameBytes) {
  MakeMap().Write(kPath);
  const std::string first = ReadFile(kPath);
  MakeMap().Write(kPath);
  EXPECT_EQ(ReadFile(kPath), first);
}

TEST(OccupancyMap, ManyLooksBeatASingleOne) {
  const RayBundle at_near{{0.05, 0.05, 0.05}, {{1.05, 0.05, 0.05}}};
  const RayBundle beyond{{0.05, 0.05, 0.05}, {{2.05, 0.05, 0.05}}};
  OccupancyMap map(0.1);
  map.Insert({at_near, beyond, beyond, beyond}, 5);
  EXPECT_TRUE(map.IsFree({1.05, 0.05, 0.05}));
  EXPECT_TRUE(map.IsOccupied({2.05, 0.05, 0.05}));
}

TEST(OccupancyMap, EmptyMapComesBackEmpty) {
  OccupancyMap(0.2).Write(kPath);
  const OccupancyMap map = OccupancyMap::Read(kPath);
  EXPECT_NEAR(map.resolution_m(), 0.2, 1e-9);
  EXPECT_TRUE(map.OccupiedVoxels().empty());
}

TEST(OccupancyMap, DamageIsNamed) {
  WriteFile(kPath, "no octree");
  EXPECT_THAT([] { OccupancyMap::Read(kPath); },
              ::testing::ThrowsMessage<DataError>(::testing::HasSubstr(kPath)));
  MakeMap().Write(kPath);
  const std::string whole = ReadFile(kPath);
  WriteFile(kPath, whole.substr(0, whole.size() - 20));
  EXPECT_THAT([] { OccupancyMap::Read(kPath); },
              ::testing::ThrowsMessage<DataError>(::testing::HasSubstr("damaged: found")));
  WriteFile(kPath, whole.substr(0, whole.find("res")));
  EXPECT_THAT([] { OccupancyMap::Read(kPath); },
              ::testing::ThrowsMessage<DataError>(::testing::HasSubstr("expected a header")));
  EXPECT_THROW(OccupancyMap::Read(kPath + ".missing"), DataError);
  EXPECT_THROW(MakeMap().Write("/dev/full"), OutputError);
}

}  // namespace
}  // namespace slcmap
