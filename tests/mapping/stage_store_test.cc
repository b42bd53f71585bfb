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

TEST(StageStore, TheDenseStageComesBackToTheLastBit) {
  const MapResult map = MadeMap();
  const auto read = UnpackDense(PackDense(map, MadeRays(), kWarnings));
  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read->dense.size(), map.dense.size());
  for (size_t i = 0; i < map.dense.size(); ++i) {
    EXPECT_EQ(read->dense[i].p_world, map.dense[i].p_world);
    EXPECT_EQ(read->dense[i].normal_world, map.dense[i].normal_world);
    EXPECT_EQ(read->dense[i].sigma_m, map.dense[i].sigma_m);
    EXPECT_EQ(read->dense[i].grey, map.dense[i].grey);
  }
  EXPECT_EQ(read->occupancy.resolution_m(), map.occupancy.resolution_m());
  EXPECT_EQ(read->occupancy.Nodes(), map.occupancy.Nodes());
  EXPECT_FALSE(map.occupancy.Nodes().empty());
  ASSERT_EQ(read->rays.size(), 2u);
  EXPECT_EQ(read->rays[0].p_world_camera, MadeRays()[0].p_world_camera);
  EXPECT_EQ(read->rays[0].p_world, MadeRays()[0].p_world);
  EXPECT_EQ(read->rays[0].sigma_m, MadeRays()[0].sigma_m);
  EXPECT_EQ(read->warnings, kWarnings);
}

TEST(StageStore, LinesComeBackToTheLastBit) {
  LineStage stage;
  MapLine line;
  line.id = 12;
  line.segment = 1;
  line.axis = LineAxis::kSloped;
  line.world = 2;
  line.sigma_m = 0.01 / 3;
  line.recent = true;
  line.start_world = {1. / 3, 2, 3};
  line.end_world = {4, 5, 6. / 7};
  line.observations = 9;
  line.deviation_rad = 0.001 / 3;
  line.deviation_sigma_rad = 0.002 / 3;
  line.kind = LineKind::kEdge;
  stage.lines = {line, MapLine()};
  LineCovariance covariance{12, 1, Eigen::Matrix3d::Random(), Eigen::Matrix3d::Random(),
                            Eigen::Matrix3d::Random()};
  stage.evidence.covariances = {covariance};
  LineSupport support{12, 1, 1600000070000000001, 1, {}};
  support.px.start = {1. / 3, 2};
  support.px.end = {3, 4};
  stage.evidence.supports = {support};
  stage.warnings = kWarnings;
  const auto read = UnpackLines(PackLines(stage));
  ASSERT_TRUE(read.has_value());
  // What is packed again are the same bytes, which hold every number.
  EXPECT_EQ(PackLines(*read), PackLines(stage));
  EXPECT_EQ(read->lines[0].end_world, line.end_world);
  EXPECT_EQ(read->lines[0].kind, line.kind);
  EXPECT_EQ(read->lines[1].axis, LineAxis::kNone);
  EXPECT_EQ(read->evidence.supports[0].stamp_ns, support.stamp_ns);
  EXPECT_EQ(read->evidence.covariances[0].end_m2, covariance.end_m2);
}

TEST(StageStore, BytesOfAnotherFormAreNothing) {
  const std::string bytes = PackLines({});
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(UnpackLines(bytes.substr(0, length)).has_value()) << length;
  }
  EXPECT_FALSE(UnpackDense(bytes).has_value());
}

TEST(StageStore, KeepsAStageForItsKeyAlone) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("stages");
  const StageStore store(path, std::string(16, 'a'));
  EXPECT_FALSE(store.Load("dense").has_value());
  store.Save("dense", [] { return "contents"; });
  EXPECT_EQ(store.Load("dense"), "contents");
  EXPECT_FALSE(store.Load("lines").has_value());
  EXPECT_FALSE(StageStore(path, std::string(16, 'b')).Load("dense").has_value());
  EXPECT_FALSE(std::filesystem::exists(path + "/dense.unfinished"));
}

TEST(StageStore, WhatIsDamagedIsNothing) {
  const testing::TempFolder folder;
  const StageStore store(folder.Path("stages"), std::string(16, 'a'));
  store.Save("dense", [] { return "contents"; });
  const std::string file = folder.Path("stages/dense"), whole = ReadFile(file);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] ^= 1;
    WriteFile(file, damaged);
    EXPECT_FALSE(store.Load("dense").has_value()) << i;
    WriteFile(file, whole.substr(0, i));
    EXPECT_FALSE(store.Load("dense").has_value()) << i;
  }
}

TEST(StageStore, RemovesWhatIsItsOwnAlone) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("stages");
  StageStore(path, std::string(16, 'a')).Save("dense", [] { return "contents"; });
  StageStore::Remove(path);
  EXPECT_FALSE(std::filesystem::exists(path));
  StageStore(path, std::string(16, 'a')).Save("dense", [] { return "contents"; });
  WriteFile(path + "/precious.txt", "of somebody");
  StageStore::Remove(path);
  EXPECT_FALSE(std::filesystem::exists(path + "/dense"));
  EXPECT_TRUE(std::filesystem::exists(path + "/precious.txt"));
  StageStore::Remove(folder.Path("nowhere"));
}

TEST(StageStore, WithoutAFolderKeepsNothing) {
  const StageStore store;
  store.Save("dense", []() -> std::string { throw std::logic_error("was asked for"); });
  EXPECT_FALSE(store.Load("dense").has_value());
}

TEST(StageStore, WhereItCannotBeWrittenKeepsNothing) {
  const testing::TempFolder folder;
  const StageStore store(folder.Write("file", "no folder"), std::string(16, 'a'));
  store.Save("dense", [] { return "contents"; });
  EXPECT_FALSE(store.Load("dense").has_value());
}

TEST(StageStore, TheKeyIsOfAllThatAStageIsMadeOf) {
  const OdometryRun run = testing::MakeWallRun();
  const std::string key = StageKey(run, "", "options", "program");
  EXPECT_EQ(key, StageKey(run, "", "options", "program"));
  EXPECT_EQ(key.size(), 16u);
  EXPECT_NE(key, StageKey(run, "other images", "options", "program"));
  EXPECT_NE(key, StageKey(run, "", "options", "another build"));
  EXPECT_NE(key, StageKey(run, "", "other options", "program"));
  OdometryRun other = run;
  other.id = "other";
  EXPECT_NE(key, StageKey(other, "", "options", "program"));
  OdometryRun calibrated = run;
  calibrated.rectified_rig.cameras[1].cx_px += 1e-9;
  EXPECT_NE(key, StageKey(calibrated, "", "options", "program"));
  calibrated = run;
  calibrated.calibration.emplace_back().right_rotation_rad.y() = 1e-9;
  EXPECT_NE(key, StageKey(calibrated, "", "options", "program"));
  OdometryRun moved = run;
  moved.keyframes.back().T_world_imu.translation.x() += 1e-15;
  EXPECT_NE(key, StageKey(moved, "", "options", "program"));
}

}  // namespace
}  // namespace slcmap
