// slcmap map --into, from images to the united map.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <array>
#include <filesystem>

#include "data/io/trajectory.h"
#include "mapping/map/map_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::RunSlcmap;
using testing::TempFolder;

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

std::string Camera(const std::string& name, double y_m) {
  return name +
         ": {camera_model: pinhole, intrinsics: [240, 240, 187.5, 119.5], distortion_model: radtan,"
         "\n  distortion_coeffs: [-0.1, 0.01, 0, 0], resolution: [376, 240],\n"
         "  T_imu_cam: [[0, -1, 0, 0], [1, 0, 0, " +
         std::to_string(y_m) + "], [0, 0, 1, 0], [0, 0, 0, 1]]}\n";
}

constexpr char kImu[] =
    "imu0: {gyroscope_noise_density: 1.7e-4, gyroscope_random_walk: 2e-5,\n"
    "  accelerometer_noise_density: 2e-3, accelerometer_random_walk: 3e-3, update_rate: 200}\n";

// A recording of a room whose images belong to two "runs" by turns, and the map of the first.
class MapInto : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const std::string scene = folder_->Write("scene.yaml", kScene);
    const std::string rig =
        folder_->Write("rig.yaml", Camera("cam0", -0.05) + Camera("cam1", 0.05) + kImu);
    EXPECT_EQ(RunSlcmap("simulate " + scene + " --rig " + rig + " -o " + Path("seq")).exit_code, 0);
    WritePoses();
    EXPECT_EQ(RunSlcmap(Map("even.tum") + "-o " + Path("first")).exit_code, 0);
  }

  static void TearDownTestSuite() { delete folder_; }

  static std::string Path(const std::string& name) { return folder_->Path(name); }

  static std::string Map(const std::string& poses) {
    return "map " + Path("seq") + " --poses " + Path(poses) + " ";
  }

  // The true poses of the images, every other one.
  static void WritePoses() {
    constexpr int64_t kStep_ns = 50'000'000;
    std::array<Trajectory, 2> poses;
    for (const StampedPose& pose : ReadTumTrajectory(Path("seq/truth/trajectory.tum"))) {
      if (pose.stamp_ns % kStep_ns == 0) poses[pose.stamp_ns / kStep_ns % 2].push_back(pose);
    }
    WriteTumTrajectory(Path("even.tum"), poses[0]);
    WriteTumTrajectory(Path("odd.tum"), poses[1]);
  }

  static TempFolder* folder_;
};

TempFolder* MapInto::folder_ = nullptr;

TEST_F(MapInto, TheMergedMapIsWrittenAndTheRunsOwnIsNotKept) {
  const ProcessResult merged =
      RunSlcmap(Map("odd.tum") + "--into " + Path("first") + " -o " + Path("both"));
  EXPECT_EQ(merged.exit_code, 0) << merged.error;
  const MapResult map = ReadMapFolder(Path("both")), first = ReadMapFolder(Path("first"));
  EXPECT_TRUE(map.complete);
  EXPECT_EQ(map.source.merged.size(), 2u);
  EXPECT_GT(map.trajectory.size(), 3 * first.trajectory.size() / 2);
  EXPECT_FALSE(std::filesystem::exists(Path("both-unmerged")));
}

TEST_F(MapInto, CtrlCLeavesTheRunsOwnMapSoFar) {
  const ProcessResult result = testing::InterruptSlcmap(
      "-v " + Map("odd.tum") + "--into " + Path("first") + " -o " + Path("stopped"),
      "poses and images agree");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_THAT(result.error, HasSubstr("stopped-unmerged: the run's own map is kept there"));
  EXPECT_FALSE(std::filesystem::exists(Path("stopped/map.json")));
  EXPECT_FALSE(ReadMapFolder(Path("stopped-unmerged")).complete);
}

TEST_F(MapInto, AStoppedMapGoesOnBehindTheStagesThatWereDone) {
  const std::string command = Map("even.tum") + "-o " + Path("again");
  const ProcessResult stopped = testing::InterruptSlcmap("-v " + command, "poses and images agree");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.error;
  EXPECT_FALSE(ReadMapFolder(Path("again")).complete);
  const ProcessResult again = RunSlcmap(command);
  EXPECT_EQ(again.exit_code, 0) << again.error;
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
