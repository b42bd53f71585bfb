#include "mapping/map/stage_store.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "data/io/file.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

// A map of what stages make, of numbers that text would round.
MapResult MadeMap() {
  MapResult map;
  for (int i = 0; i < 3; ++i) {
    DensePoint point;
    point.p_world = Eigen::Vector3d(1. / 3, -2. / 7, 1e-9) * (i + 1);
    point.normal_world = Eigen::Vector3d(1, 2, 3).normalized();
    point.sigma_m = 0.1 / 3;
    point.grey = static_cast<uint8_t>(250 + i);
    map.dense.push_back(point);
  }
  map.occupancy = OccupancyMap(0.1 / 3);
  map.occupancy.Update({{{1, 2, 3}, {1, 2, 4}}, {{1, 2, 5}}});
  map.occupancy.Finish();
  return map;
}

std::vector<ViewRays> MadeRays() {
  ViewRays rays;
  rays.p_world_camera = {0.1, 1. / 3, 2};
  rays.p_world = {{0.3f, 0.7f, 1.f / 3}, {4, 5, 6}};
  rays.sigma_m = {0.01f / 3, 0.2f};
  return {rays, {}};
}

const CountedWarnings kWarnings = {{"rays_out_of_octree", 7}};

// What is packed again are the same bytes, which hold every number.
TEST(StageStore, StagesComeBackToTheLastBit) {
  const MapResult map = MadeMap();
  const std::string dense_bytes = PackDense(map, MadeRays(), kWarnings);
  auto dense = UnpackDense(dense_bytes);
  ASSERT_TRUE(dense.has_value());
  ASSERT_EQ(dense->dense.size(), map.dense.size());
  EXPECT_EQ(dense->dense[2].p_world, map.dense[2].p_world);
  EXPECT_EQ(dense->dense[2].normal_world, map.dense[2].normal_world);
  EXPECT_EQ(dense->dense[2].grey, map.dense[2].grey);
  EXPECT_EQ(dense->occupancy.resolution_m(), map.occupancy.resolution_m());
  EXPECT_EQ(dense->occupancy.Nodes(), map.occupancy.Nodes());
  EXPECT_FALSE(map.occupancy.Nodes().empty());
  EXPECT_EQ(dense->rays.at(0).p_world, MadeRays()[0].p_world);
  EXPECT_EQ(dense->rays.at(0).sigma_m, MadeRays()[0].sigma_m);
  EXPECT_EQ(dense->warnings, kWarnings);
  MapResult again;
  again.dense = dense->dense;
  again.occupancy = std::move(dense->occupancy);
  EXPECT_EQ(PackDense(again, dense->rays, dense->warnings), dense_bytes);

  LineStage stage;
  MapLine line;
  line.id = 12;
  line.axis = LineAxis::kSloped;
  line.sigma_m = 0.01 / 3;
  line.recent = true;
  line.end_world = {4, 5, 6. / 7};
  line.deviation_sigma_rad = 0.002 / 3;
  line.kind = LineKind::kEdge;
  stage.lines = {line, MapLine()};
  stage.evidence.covariances = {
      {12, 1, Eigen::Matrix3d::Random(), Eigen::Matrix3d::Random(), Eigen::Matrix3d::Random()}};
  stage.evidence.supports = {{12, 1, 1600000070000000001, 1, {{1. / 3, 2}, {3, 4}}}};
  stage.warnings = kWarnings;
  const auto lines = UnpackLines(PackLines(stage));
  ASSERT_TRUE(lines.has_value());
  EXPECT_EQ(PackLines(*lines), PackLines(stage));
  EXPECT_EQ(lines->lines[0].end_world, line.end_world);
  EXPECT_EQ(lines->lines[0].kind, line.kind);
  EXPECT_EQ(lines->lines[1].axis, LineAxis::kNone);
  EXPECT_EQ(lines->evidence.supports[0].stamp_ns, 1600000070000000001);
  EXPECT_EQ(lines->evidence.covariances[0].end_m2, stage.evidence.covariances[0].end_m2);
}

TEST(StageStore, BytesOfAnotherFormAreNothing) {
  const std::string bytes = PackLines({});
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(UnpackLines(bytes.substr(0, length)).has_value()) << length;
  }
  EXPECT_FALSE(UnpackDense(bytes).has_value());
}

class StageStoreTest : public ::testing::Test {
 protected:
  static std::string Contents() { return "contents"; }

  const testing::TempFolder folder_;
  const std::string path_ = folder_.Path("stages");
  const StageStore store_{path_, std::string(16, 'a')};
};

TEST_F(StageStoreTest, KeepsAStageForItsKeyAlone) {
  EXPECT_FALSE(store_.Load("dense").has_value());
  store_.Save("dense", Contents);
  EXPECT_EQ(store_.Load("dense"), "contents");
  EXPECT_FALSE(store_.Load("lines").has_value());
  EXPECT_FALSE(StageStore(path_, std::string(16, 'b')).Load("dense").has_value());
  EXPECT_FALSE(std::filesystem::exists(path_ + "/dense.unfinished"));
}

TEST_F(StageStoreTest, WhatIsDamagedIsNothing) {
  store_.Save("dense", Contents);
  const std::string file = path_ + "/dense", whole = ReadFile(file);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] ^= 1;
    WriteFile(file, damaged);
    EXPECT_FALSE(store_.Load("dense").has_value()) << i;
    WriteFile(file, whole.substr(0, i));
    EXPECT_FALSE(store_.Load("dense").has_value()) << i;
  }
}

TEST_F(StageStoreTest, RemovesWhatIsItsOwnAlone) {
  store_.Save("dense", Contents);
  StageStore::Remove(path_);
  EXPECT_FALSE(std::filesystem::exists(path_));
  store_.Save("dense", Contents);
  WriteFile(path_ + "/precious.txt", "of somebody");
  StageStore::Remove(path_);
  EXPECT_FALSE(std::filesystem::exists(path_ + "/dense"));
  EXPECT_TRUE(std::filesystem::exists(path_ + "/precious.txt"));
  StageStore::Remove(folder_.Path("nowhere"));
}

TEST_F(StageStoreTest, WithoutAFolderOrWhereItCannotBeWrittenKeepsNothing) {
  const StageStore nowhere, on_file(folder_.Write("file", "no folder"), std::string(16, 'a'));
  nowhere.Save("dense", []() -> std::string { throw std::logic_error("was asked for"); });
  EXPECT_FALSE(nowhere.Load("dense").has_value());
  on_file.Save("dense", Contents);
  EXPECT_FALSE(on_file.Load("dense").has_value());
}

TEST(StageStore, TheKeyIsOfAllThatAStageIsMadeOf) {
  const OdometryRun run = testing::MakeWallRun();
  const std::string key = StageKey(run, "", "options", "program");
  EXPECT_EQ(key, StageKey(run, "", "options", "program"));
  EXPECT_EQ(key.size(), 16u);
  EXPECT_NE(key, StageKey(run, "other images", "options", "program"));
  EXPECT_NE(key, StageKey(run, "", "options", "another build"));
  EXPECT_NE(key, StageKey(run, "", "other options", "program"));
  OdometryRun other = run, calibrated = run, turned = run, moved = run;
  other.id = "other";
  calibrated.rectified_rig.cameras[1].cx_px += 1e-9;
  turned.calibration.emplace_back().right_rotation_rad.y() = 1e-9;
  moved.keyframes.back().T_world_imu.translation.x() += 1e-15;
  for (const OdometryRun& changed : {other, calibrated, turned, moved}) {
    EXPECT_NE(key, StageKey(changed, "", "options", "program"));
  }
}

}  // namespace
}  // namespace slcmap
