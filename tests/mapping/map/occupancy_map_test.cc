#include "mapping/map/occupancy_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <memory>

#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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

TEST(OccupancyMap, RaysMakeSpaceFreeAndTheirEndsOccupiedAlsoBackFromItsFile) {
  ExpectRays(MakeMap());
  MakeMap().Write(kPath);
  const OccupancyMap map = OccupancyMap::Read(kPath);
  EXPECT_NEAR(map.resolution_m(), 0.1, 1e-9);
  ExpectRays(map);
}

// OctoMap's own reader, which the headers are written for.
TEST(OccupancyMap, OctomapReadsTheFiles) {
  OccupancyMap map = MakeMap();
  map.Insert({{{0.05, 0.05, 0.05}, {{3.05, 0.05, 0.05}}}}, 5);
  map.Write(kPath);
  octomap::OcTree tree(1);
  ASSERT_TRUE(tree.readBinary(kPath));
  EXPECT_NEAR(tree.getResolution(), 0.1, 1e-9);
  const octomap::OcTreeNode* node = tree.search(3.05, 0.05, 0.05);
  ASSERT_NE(node, nullptr);
  EXPECT_TRUE(tree.isNodeOccupied(node));
  const std::string path = kFolder.Path("a.ot");
  map.WriteProbabilities(path);
  const std::unique_ptr<octomap::AbstractOcTree> file(octomap::AbstractOcTree::read(path));
  const auto* probable = dynamic_cast<octomap::OcTree*>(file.get());
  ASSERT_NE(probable, nullptr);
  EXPECT_NEAR(probable->getResolution(), 0.1, 1e-9);
  const octomap::OcTreeNode* twice = probable->search(3.05, 0.05, 0.05);
  const octomap::OcTreeNode* once = probable->search(0.05, 4.55, 0.05);  // free, by one bundle
  ASSERT_NE(twice, nullptr);
  ASSERT_NE(once, nullptr);
  EXPECT_GT(twice->getOccupancy(), probable->getProbHit());
  EXPECT_NEAR(once->getOccupancy(), probable->getProbMiss(), 1e-6);
}

TEST(OccupancyMap, ManyLooksBeatASingleOne) {
  const RayBundle at_near{{0.05, 0.05, 0.05}, {{1.05, 0.05, 0.05}}};
  const RayBundle beyond{{0.05, 0.05, 0.05}, {{2.05, 0.05, 0.05}}};
  OccupancyMap map(0.1);
  map.Insert({at_near, beyond, beyond, beyond}, 5);
  EXPECT_TRUE(map.IsFree({1.05, 0.05, 0.05}));
  EXPECT_TRUE(map.IsOccupied({2.05, 0.05, 0.05}));
}

TEST(OccupancyMap, ReadsWhatOctomapWrites) {
  octomap::OcTree tree(0.25);
  tree.updateNode(octomap::point3d(1.1F, 2.1F, -3.1F), true);
  tree.updateInnerOccupancy();
  ASSERT_TRUE(tree.writeBinary(kPath));
  const OccupancyMap map = OccupancyMap::Read(kPath);
  EXPECT_EQ(map.resolution_m(), 0.25);
  EXPECT_TRUE(map.IsOccupied({1.1, 2.1, -3.1}));
  EXPECT_EQ(map.OccupiedVoxels().size(), 1u);
}

TEST(OccupancyMap, RaysThatLeaveTheOctreeAreCounted) {
  OccupancyMap map(0.001);
  const RayBundle inside{{0, 0, 0}, {{0.5, 0, 0}, {40, 0, 0}}}, outside{{100, 0, 0}, {{99, 0, 0}}};
  EXPECT_EQ(map.Insert({inside, outside}, 1000), 2);  // beyond 32.8 m
  EXPECT_TRUE(map.IsOccupied({0.5, 0, 0}));
  EXPECT_FALSE(map.IsOccupied({40, 0, 0}));
}

TEST(OccupancyMap, WhatTakesLongToFinishIsNotKeptWhenItsCallerEndsIt) {
  RayBundle first{{0, 0, 0}, {}}, second{{0, 0, 0}, {{0, 1, 0}}};
  for (int i = 0; i < 60; ++i) first.p_world.emplace_back(20, 0.3 * i, 1);  // over a million cells
  const Progress ends([](double done) { return done < 0.5; });
  OccupancyMap coarse(0.1), fine(0.001);
  coarse.Insert({first, second}, 25, ends);
  EXPECT_TRUE(coarse.IsOccupied({20, 0, 1}));
  EXPECT_FALSE(coarse.IsOccupied({0, 1, 0}));
  fine.Insert({first, second}, 20, ends);
  EXPECT_TRUE(fine.FreeVoxels().empty());
}

std::string ReadError(const std::string& bytes) {
  WriteFile(kPath, bytes);
  return testing::MessageOf<DataError>([] { OccupancyMap::Read(kPath); });
}

std::string WholeFile() {
  MakeMap().Write(kPath);
  return ReadFile(kPath);
}

// OctoMap's own reader calls itself for every pair of such bytes.
TEST(OccupancyMap, ATreeWithoutEndIsRefused) {
  const std::string deep(250000, '\xff');
  EXPECT_THAT(ReadError(WholeFile() + deep), HasSubstr("found 250000 more bytes"));
  const std::string header = WholeFile().substr(0, WholeFile().find("data\n") + 5);
  EXPECT_THAT(ReadError(header + deep), HasSubstr("found a node deeper than 16"));
  const std::string whole = WholeFile();
  EXPECT_THAT(ReadError(whole.substr(0, whole.size() - 4) + deep), HasSubstr("damaged: found"));
}

TEST(OccupancyMap, NodesThatDoNotFitTheirHeaderAreRefused) {
  const std::string whole = WholeFile();
  const std::size_t data = whole.find("data\n") + 5;
  EXPECT_THAT(ReadError(whole.substr(0, whole.size() - 20)),
              HasSubstr("found the end of the file"));
  EXPECT_THAT(ReadError(whole + '\n'), HasSubstr("found 1 more bytes"));
  std::string childless = whole;
  childless[data] = childless[data + 1] = 0;
  EXPECT_THAT(ReadError(childless), HasSubstr("an inner node without children"));
  std::string fewer = whole;
  fewer.replace(fewer.find("size ") + 5, 1, "9");
  EXPECT_THAT(ReadError(fewer), AllOf(HasSubstr("expected 9"), HasSubstr("as in the header")));
  EXPECT_THAT(ReadError("# Octomap OcTree binary file\nid OcTree\nsize 0\nres 0.1\ndata\nmore"),
              HasSubstr("found 4 more bytes"));
}

TEST(OccupancyMap, HeadersThatCannotBeAreRefused) {
  const auto with = [](const std::string& rows) {
    return ReadError("# Octomap OcTree binary file\n" + rows);
  };
  EXPECT_THAT(ReadError("no octree"), AllOf(HasSubstr(kPath), HasSubstr("row 1")));
  EXPECT_THAT(ReadError("no octree\n"), HasSubstr("row 1: found 'no octree', expected '# Octomap"));
  for (const char* res : {"1e300", "inf", "nan", "0", "-0.1", "0.1x", "", "1e-9"}) {
    EXPECT_THAT(with(std::string("id OcTree\nsize 0\nres ") + res + "\ndata\n"),
                HasSubstr("expected 'res' with 0.001 to 100 m"));
  }
  for (const char* size : {"-1", "1e3", "99999999999999999999999"}) {
    EXPECT_THAT(with(std::string("id OcTree\nsize ") + size + "\nres 0.1\ndata\n"),
                HasSubstr("row 3: found 'size"));
  }
  EXPECT_THAT(with("id ColorOcTree\nsize 0\nres 0.1\ndata\n"), HasSubstr("expected 'id OcTree'"));
  EXPECT_THAT(with("id OcTree\nsize 0\nsize 0\nres 0.1\ndata\n"), HasSubstr("row 4: found 'size"));
  EXPECT_THAT(with("id OcTree\nsize 0\ndata\n"), HasSubstr("expected 'id', 'size' and 'res'"));
  EXPECT_THAT(with("id OcTree\nsize 0\nres 0.1\n"), HasSubstr("up to 'data'"));
}

TEST(OccupancyMap, FilesThatAreNotThereAreNamed) {
  EXPECT_THROW(OccupancyMap::Read(kPath + ".missing"), DataError);
  EXPECT_THROW(MakeMap().Write("/dev/full"), OutputError);
}

}  // namespace
}  // namespace slcmap
