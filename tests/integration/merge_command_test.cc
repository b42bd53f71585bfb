// slcmap merge, and maps that were stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <array>
#include <filesystem>

#include "data/io/file.h"
#include "data/io/trajectory.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"
#include "tests/testing/scanned_map.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::RunSlcmap;
using testing::ScannedMap;
using testing::TempFolder;

// Map folders: two runs of one room, one of another, one of an empty place, and a run.
class MergeCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Scene room = testing::RoomWithBoxes("[5, 4]", "[[0, 0], [5, 0], [5, 4], [0, 4]]");
    const Scene other =
        testing::RoomWithBoxes("[9, 7]", "[[0, 0], [9, 0], [9, 3], [6, 7], [0, 7]]");
    WriteMapFolder(Path("a"), ScannedMap(room, {{1.5, 2, 1.5}, {3.5, 2.2, 1.5}}));
    WriteMapFolder(Path("b"), ScannedMap(room, {{3, 1.5, 1.5}, {2, 2.5, 1.5}},
                                         LevelTransform(0.7, {2, 1, 0.1}), "b"));
    WriteMapFolder(Path("other"), ScannedMap(other, {{5, 5, 1.5}, {6, 2, 1.5}}, {}, "c"));
    WriteRunFolder(Path("run"), testing::MakeWallRun());
    RunSlcmap("map " + Path("run") + " --sparse -o " + Path("sparse"));
  }

  static std::string Path(const std::string& name) { return folder_.Path(name); }
  // The command with the names of folders in it replaced by their paths.
  static ProcessResult Merge(const std::string& first, const std::string& second,
                             const std::string& rest = "", const std::string& output = "out") {
    return RunSlcmap("merge " + Path(first) + " " + Path(second) + " -o " + Path(output) + " " +
                     rest);
  }

  inline static const TempFolder folder_;
};

TEST_F(MergeCommand, TwoMapsBecomeOneThatIsExported) {
  const ProcessResult merged = Merge("a", "b", "", "merged");
  EXPECT_EQ(merged.exit_code, 0) << merged.error;
  EXPECT_THAT(merged.error, HasSubstr("of 2 runs"));
  EXPECT_EQ(ReadMapFolder(Path("merged")).source.merged.size(), 2u);
  ExpectSuccess("export " + Path("merged") + " -o " + Path("export") + " --format ply,colmap");
  // Images have the stamps of their recordings, which both begin at one second.
  for (const char* name : {" a/cam0/data/1000000000.png", " b/cam1/data/1000000000.png"}) {
    EXPECT_THAT(ReadFile(Path("export/colmap/images.txt")), HasSubstr(name));
  }
  // Its runs are in it already.
  ExpectError(Merge("merged", "b"), 1, "found run b in both maps");
}

TEST_F(MergeCommand, WhatDoesNotFitIsRefusedAndNothingWritten) {
  const ProcessResult merged = Merge("a", "other");
  EXPECT_EQ(merged.exit_code, 1) << merged.error;
  EXPECT_THAT(merged.error, HasSubstr("expected"));
  EXPECT_FALSE(std::filesystem::exists(Path("out")));
}

TEST_F(MergeCommand, ARoughStartIsFollowed) {
  // The place of b's origin in a, and its turn, about.
  const RigidTransform T = LevelTransform(0.7, {2, 1, 0.1}).Inverse();
  const std::string near =
      fmt::format("--at {:.1f},{:.1f},0,-50", T.translation.x() + 0.5, T.translation.y() - 0.5);
  const ProcessResult merged = Merge("a", "b", near, "started");
  EXPECT_EQ(merged.exit_code, 0) << merged.error;
  EXPECT_EQ(Merge("a", "b", "--at 0,0,0,130").exit_code, 1) << "far from there";
}

TEST_F(MergeCommand, WrongUsageAndMapsThatCannotBeMergedAreNamed) {
  ExpectError("merge " + Path("a") + " -o " + Path("out"), 2, "found one map");
  ExpectError(Merge("a", "b", "", "a"), 2, "a");
  ExpectError(Merge("a", "b", "--at 1,2,x,4"), 2, "X,Y,Z,YAW_DEG");
  ExpectError(Merge("a", "b", Path("other") + " --at 1,2,3,4"), 2, "expected two");
  ExpectError(Merge("a", "run"), 1, "expected a map folder");
  ExpectError(Merge("a", "nowhere"), 1, "no such folder");
  ExpectError(Merge("a", "a"), 1, "found run a in both maps");
  ExpectError(Merge("a", "sparse"), 1, "--sparse");
}

TEST_F(MergeCommand, MapsOfTheSamePosesAreNotUnited) {
  const TempFolder recording;
  testing::WriteSequence(recording, {.images = 7});
  std::string poses;
  for (int i = 0; i < 6; ++i) {
    poses += fmt::format("{:.9f} {} 0 0 0 0 0 1\n", ToSeconds(testing::ImageStamp(i)), 0.04 * i);
  }
  WriteFile(Path("poses.tum"), poses);
  const std::string map = "map " + recording.Path() + " --poses " + Path("poses.tum") + " -o ";
  const ProcessResult mapped = ExpectSuccess(map + Path("posed"));
  EXPECT_THAT(mapped.error, HasSubstr("1 of 7 images have no pose"));
  RunSlcmap(map + Path("again"));
  const ProcessResult refused = Merge("posed", "again");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.error, AllOf(HasSubstr("error: "), HasSubstr("in both maps")));
}

// From images to the united map.

constexpr char kScene[] = R"(name: small_room
objects:
  - {kind: wall, points: [[0, 0], [5, 0], [5, 4], [0, 4]], closed: true, material: brick}
  - {kind: slab, at: [0, 0, 0], size: [5, 4], material: carpet}
  - {kind: lamp, at: [2, 2, 2.9], size: [1, 0.5], radiance: 30}
  - {kind: box, at: [3.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.8, 0.4, 0], size: [1.0, 0.6, 0.75]}
trajectory:
  kind: robot
  waypoints_m: [[0.8, 2, 1.2], [2, 1.2, 1.2], [3, 2, 1.2], [2, 2.8, 1.2]]
  stand_still_s: 0.1
)";

// A recording of a room whose images belong to two "runs" by turns, and the map of the first.
class PosedMaps : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string scene = folder_.Write("scene.yaml", kScene);
    const std::string rig = folder_.Write("rig.yaml", testing::RigYaml(4));
    ExpectSuccess("simulate " + scene + " --rig " + rig + " -o " + Path("seq"));
    WritePoses();
    ExpectSuccess(Map("even.tum") + "-o " + Path("first"));
  }

  static std::string Path(const std::string& name) { return folder_.Path(name); }

  static std::string Map(const std::string& poses) {
    return "map " + Path("seq") + " --poses " + Path(poses) + " ";
  }

  // The true poses of the images, every other one.
  static void WritePoses() {
    constexpr int64_t kStep_ns = 50'000'000;
    std::array<Trajectory, 2> poses;
    for (const StampedPose& pose : ReadTrajectory(Path("seq/truth/trajectory.tum"))) {
      if (pose.stamp_ns % kStep_ns == 0) poses[pose.stamp_ns / kStep_ns % 2].push_back(pose);
    }
    WriteTumTrajectory(Path("even.tum"), poses[0]);
    WriteTumTrajectory(Path("odd.tum"), poses[1]);
  }

  inline static const TempFolder folder_;
};

TEST_F(PosedMaps, AreMergedFromImagesOn) {
  ExpectSuccess(Map("odd.tum") + "-o " + Path("second"));
  const ProcessResult merged =
      ExpectSuccess("merge " + Path("first") + " " + Path("second") + " -o " + Path("both"));
  const MapResult map = ReadMapFolder(Path("both")), first = ReadMapFolder(Path("first"));
  EXPECT_TRUE(map.complete);
  EXPECT_EQ(map.source.merged.size(), 2u);
  EXPECT_GT(map.trajectory.size(), 3 * first.trajectory.size() / 2);
}

TEST_F(PosedMaps, AStoppedMapGoesOnBehindTheStagesThatWereDone) {
  const std::string command = Map("even.tum") + "-o " + Path("again");
  const ProcessResult stopped = testing::InterruptSlcmap("-v " + command, "poses and images agree");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.error;
  EXPECT_FALSE(ReadMapFolder(Path("again")).complete);
  const ProcessResult again = ExpectSuccess(command);
  EXPECT_THAT(again.error, HasSubstr("goes on behind the stage dense"));
  for (const auto& file : std::filesystem::directory_iterator(Path("first"))) {
    const std::string name = file.path().filename().string();
    EXPECT_EQ(testing::ReadText(Path("again/" + name)), testing::ReadText(file.path().string()))
        << name;
  }
  EXPECT_FALSE(std::filesystem::exists(Path("again/.stages")));
}

}  // namespace
}  // namespace slcmap
