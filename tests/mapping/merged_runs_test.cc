#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/json.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/part_files.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

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

// Earlier versions did not say when each run has poses.
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
