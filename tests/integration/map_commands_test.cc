// The commands behind odometry: map, export and evaluate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/io/map_line.h"
#include "data/io/ply.h"
#include "odometry/run/run_folder.h"
#include "tests/integration/made_map.h"
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
using testing::TempFolder;

class OverwritingTest : public testing::MadeMap {};

TEST_F(OverwritingTest, ARunBecomesAMapAndItsExport) {
  const std::string out = folder_.Path("export"), command = "export " + map_ + " -o " + out;
  EXPECT_THAT(RunSlcmap("map " + run_ + " -o " + map_).error, HasSubstr("51 poses"));
  ExpectSuccess(command + " --format glb,ply");
  EXPECT_GT(std::filesystem::file_size(out + "/scene.glb"), 10000u);
  EXPECT_TRUE(std::filesystem::exists(out + "/trajectory.ply"));
  const ProcessResult onto_a_file = RunSlcmap(command + "/scene.glb");
  EXPECT_EQ(onto_a_file.exit_code, 1) << onto_a_file.error;
  EXPECT_THAT(onto_a_file.error, HasSubstr("scene.glb"));
}

TEST(MapCommands, LinesReachTheMapAndTheExport) {
  const TempFolder folder;
  WriteRunFolder(folder.Path("run"), testing::MakeLineRun());
  const ProcessResult map = RunSlcmap("map " + folder.Path("run") + " -o " + folder.Path("map"));
  EXPECT_THAT(map.error, HasSubstr("24 lines"));
  EXPECT_EQ(ReadMapLines(folder.Path("map/lines.ply")).size(), 24u);
  ExpectSuccess("export " + folder.Path("map") + " -o " + folder.Path("export"));
  EXPECT_EQ(ReadLinesPly(folder.Path("export/lines.ply")).size(), 24u);
  ExpectSuccess("export " + folder.Path("map") + " -o " + folder.Path("text") +
                " --format ply,limap --ascii-ply");
  EXPECT_THAT(testing::ReadText(folder.Path("text/lines.ply")),
              ::testing::StartsWith("ply\nformat ascii 1.0\n"));
  EXPECT_EQ(ReadLinesPly(folder.Path("text/lines.ply")).size(), 24u);
  // Both images of five keyframes.
  EXPECT_THAT(testing::ReadText(folder.Path("text/limap/alltracks.txt")),
              ::testing::StartsWith("24\n0 10 10\n"));
}

TEST(MapCommands, TheVerdictOnTheRunIsToldAndKeptAndSegmentsAreReported) {
  const TempFolder folder;
  OdometryRun run = testing::MakeWallRun();
  run.verdict.emplace().Add(
      {VerdictLevel::kFailed, "points-rejected", "80 %", "at most 12 %", "let slcmap check it"});
  for (size_t i = run.states.size() / 2; i < run.states.size(); ++i) run.states[i].segment = 1;
  WriteRunFolder(folder.Path("run"), run);
  const ProcessResult map =
      ExpectSuccess("-q map " + folder.Path("run") + " -o " + folder.Path("map"));
  EXPECT_THAT(map.error, AllOf(HasSubstr("run: verdict: failed"),
                               HasSubstr("points-rejected: found 80 %, expected at most 12 %; "
                                         "remedy: let slcmap check it"),
                               HasSubstr("run: the estimator lost itself 1 times")));
  EXPECT_THAT(testing::ReadText(folder.Path("map/map.json")),
              HasSubstr("\"verdict\": {\n    \"level\": \"failed\""));
}

void WriteRunWithoutPoses(const std::string& folder) {
  OdometryRun run = testing::MakeWallRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
  run.warnings["attempts at initialisation that failed"] = 7;
  WriteRunFolder(folder, run);
}

TEST_F(OverwritingTest, ARunWithoutPosesIsAnEmptyMapThatSaysWhyAndReplacesNoMapOfSomething) {
  WriteRunWithoutPoses(folder_.Path("empty"));
  const auto map = [&](const std::string& to) {
    return RunSlcmap("-q map " + folder_.Path("empty") + " -o " + folder_.Path(to));
  };
  const ProcessResult first = map("new");
  EXPECT_EQ(first.exit_code, 0) << first.error;
  EXPECT_EQ(first.ErrorLines(), 3) << first.error;
  EXPECT_THAT(first.error, AllOf(HasSubstr("empty: verdict: failed"),
                                 HasSubstr("empty: found no pose"), HasSubstr("the map is empty"),
                                 HasSubstr("attempts at initialisation that failed: 7")));
  EXPECT_EQ(map("new").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("new/previous-1")));
  ExpectSuccess("-q export " + folder_.Path("new") + " -o " + folder_.Path("out"));
  EXPECT_THAT(map("map").error, HasSubstr("partial results do not replace complete ones"));
  EXPECT_TRUE(std::filesystem::exists(map_ + "/previous-1/map.json"));
}

TEST_F(OverwritingTest, ErrorsNameThePlace) {
  const std::string none = folder_.Path("none");
  ExpectError("map " + run_, 2, "map: found no --output, expected one");
  ExpectError("map " + run_ + " -o /proc/map", 1, "/proc/map");
  const std::string config = folder_.Write("bad.yaml", "mapping: {cloud: {voxel: 1}}\n");
  ExpectError("map " + run_ + " -o " + map_ + " --config " + config, 2,
              "bad.yaml: mapping.cloud.voxel: unknown key");
  ExpectError("export " + map_ + " -o " + none + " --format step", 2, "found 'step'");
  EXPECT_FALSE(std::filesystem::exists(none));
  for (const std::string& command : {"map " + run_, "view " + map_, "run " + run_}) {
    ExpectError(command + " -o ''", 2, "--output: found an empty text");
  }
}

TEST_F(OverwritingTest, AStagesInputIsNeverItsOutput) {
  const std::string landmarks = testing::ReadText(run_ + "/points.ply"),
                    points = testing::ReadText(map_ + "/points.ply");
  std::filesystem::create_directory_symlink(run_, folder_.Path("link"));
  for (const std::string& name : {run_ + "/../run", folder_.Path("link")}) {
    ExpectError("map " + run_ + " -o " + name, 2, "found the input");
  }
  ExpectError("export " + map_ + " -o " + map_, 2, "found the input");
  EXPECT_EQ(testing::ReadText(run_ + "/points.ply"), landmarks);
  EXPECT_EQ(testing::ReadText(map_ + "/points.ply"), points);
}

TEST_F(OverwritingTest, AnotherStagesFolderIsNoOutput) {
  const std::string other = folder_.Path("other");
  WriteRunFolder(other, testing::MakeLineRun());
  ExpectError("map " + run_ + " -o " + other, 2, "other: found a run in it (run.json)");
  ExpectError("export " + map_ + " -o " + run_, 2, "found a run in it");
  EXPECT_EQ(ReadRunFolder(other).lines.size(), 24u);
}

class ViewTest : public OverwritingTest {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(SLCMAP_PAGE)) {
      GTEST_SKIP() << "the page was not built: it needs npm";
    }
  }
};

TEST_F(ViewTest, WritesOnePageOverAnEarlierOne) {
  const std::string page = folder_.Path("map.html");
  for (int i = 0; i < 2; ++i) {
    ExpectSuccess("view " + map_ + " -o " + page);
  }
  EXPECT_THAT(testing::ReadText(page),
              AllOf(::testing::StartsWith("<!doctype html>"), HasSubstr("</html>")));
  EXPECT_FALSE(std::filesystem::exists(page + ".unfinished"));
}

TEST_F(ViewTest, WrongPlacesAreNamedAndLeftAsTheyWere) {
  ExpectError("view " + map_ + " -o " + folder_.Path(), 2,
              "found a folder, expected a file's name");
  ExpectError("view " + map_ + " -o " + map_ + "/map.html", 2, "map.html");
  ExpectError("view " + run_ + " -o " + folder_.Path("map.html"), 1,
              "run: found a run folder, expected a map folder");
  ExpectError("view " + map_ + " -o " + run_ + "/run.json", 2, "no page");
  ExpectError("view " + map_ + " -o " + folder_.Path("new/"), 2, "folder's name");
  ExpectError("view " + map_ + " -o /proc/map.html", 1, "/proc/map.html");
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("map.html")));
  EXPECT_FALSE(std::filesystem::exists(map_ + "/map.html"));
}

TEST_F(ViewTest, WhatCannotBeServedIsNamed) {
  ExpectError("view --serve " + map_, 1, "found no tileset.json in it or below");
  ExpectError("view --serve " + folder_.Path("none"), 1, "none: found no tileset.json");
  ExpectError("view " + map_, 2, "--output: missing");
  ExpectError("view --serve " + map_ + " --port 70000", 2, "70000");
  ExpectError("view " + map_ + " --serve " + map_, 2, "--serve");
}

TEST_F(ViewTest, PicturesNeedTheRecording) {
  const std::string view = "view " + map_ + " -o " + folder_.Path("map.html");
  ExpectError(view + " --images --sequence " + folder_.Path("gone"), 1,
              "gone, expected the one that the map was made of");
  ExpectError(view + " --sequence " + map_, 2, "--images");
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("map.html")));
}

TEST_F(ViewTest, PicturesComeFromWhereTheRecordingIs) {
  testing::WriteSequence(folder_, {});
  std::string poses;
  for (int i = 0; i < 5; ++i) {
    poses += fmt::format("{:.9f} {} 0 0 0 0 0 1\n",
                         1e-9 * static_cast<double>(testing::ImageStamp(i)), 0.2 * i);
  }
  const std::string map = folder_.Path("posed"), moved = folder_.Path("moved"),
                    plain = folder_.Path("plain.html"), page = folder_.Path("map.html");
  ExpectSuccess("map " + folder_.Path("mav0") + " --poses " + folder_.Write("poses.tum", poses) +
                " -o " + map);
  ExpectSuccess("view " + map + " -o " + plain);
  ExpectSuccess("view " + map + " -o " + page + " --images");
  EXPECT_GT(std::filesystem::file_size(page), std::filesystem::file_size(plain) + 2000);
  std::filesystem::create_directory(moved);
  std::filesystem::rename(folder_.Path("mav0"), moved + "/mav0");
  const ProcessResult lost = RunSlcmap("view " + map + " -o " + page + " --images");
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_THAT(lost.error, HasSubstr("error: " + map + ": --images: found no recording"));
  ExpectSuccess("view " + map + " -o " + page + " --images --sequence " + moved);
}

TEST_F(OverwritingTest, AnotherKindOfFolderIsNamed) {
  const std::string none = folder_.Path("none");
  const std::pair<std::string, std::string> kWrong[] = {
      {"map " + map_, "map: found a map folder, expected a run folder"},
      {"map " + none, "none: found no such folder, expected a run folder"},
      {"map " + run_ + "/run.json", "run.json: found a file, expected a run folder"},
      {"map " + folder_.Path(), "/run'?"},  // that of both
      {"export " + run_, "run: found a run folder, expected a map folder"},
      {"export " + none, "none: found no such folder, expected a map folder"},
      {"export " + folder_.Path(), "/map'?"},
      {"odometry " + map_, "map: found a map folder, expected a recorded sequence"}};
  for (const auto& [command, words] : kWrong) {
    SCOPED_TRACE(command);
    ExpectError(command + " -o " + folder_.Path("out"), 1, words);
  }
}

TEST_F(OverwritingTest, AMapTooLargeForMemoryIsRefusedWithWhatWouldDo) {
  const std::string config = folder_.Write(
      "fine.yaml", "mapping: {occupancy: {resolution_m: 0.001, max_voxels: 100000}}\n");
  const std::string summary = testing::ReadText(map_ + "/map.json");
  ExpectError("map " + run_ + " --sparse -o " + map_ + " --config " + config, 2,
              "mapping.occupancy.resolution_m: found 0.001");
  EXPECT_EQ(testing::ReadText(map_ + "/map.json"), summary);
  ExpectError("export " + map_ + " -o " + folder_.Path("e") + " --max-vertices 1000", 2,
              "expected at most 1000");
}

TEST_F(OverwritingTest, CtrlCLeavesTheMapSoFar) {
  const std::string config = folder_.Write(
      "fine.yaml", "mapping: {occupancy: {resolution_m: 0.003, max_voxels: 1000000000}}\n");
  const ProcessResult result = testing::InterruptSlcmap(
      "-v map " + run_ + " -o " + folder_.Path("new") + " --config " + config, "6 keyframes");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_THAT(result.error, HasSubstr("stopping; interrupted once more it ends at once"));
  EXPECT_THAT(result.error, HasSubstr("new: the map is partial: mapping was interrupted"));
  EXPECT_THAT(testing::ReadText(folder_.Path("new/map.json")),
              AllOf(HasSubstr("\"complete\": false"), HasSubstr("mapping was interrupted")));
}

TEST_F(OverwritingTest, ChangedFilesNeedAWord) {
  const std::string lines = testing::ReadText(run_ + "/observations.csv");
  folder_.Write("run/observations.csv", lines.substr(0, lines.rfind('\n', lines.size() - 2) + 1));
  const std::string command = "map " + run_ + " -o " + map_;
  ExpectError(command, 1, "observations, expected 2400 as in run.json");
  ExpectSuccess("-q " + command + " --accept-changed");
  EXPECT_THAT(testing::ReadText(map_ + "/map.json"), HasSubstr("\"changed_files_accepted\": 1"));
}

TEST_F(OverwritingTest, AMapOfAnotherRunThanTheOneBesideItIsRefused) {
  const std::string command = "export " + map_ + " -o " + folder_.Path("export");
  ExpectSuccess("-q " + command);
  OdometryRun newer = testing::MakeWallRun();
  newer.landmarks[0].sigma_m *= 2;
  WriteRunFolder(run_, newer);
  ExpectError(command, 1, "map that run first");
  ExpectSuccess("-q " + command + " --accept-changed");
}

}  // namespace
}  // namespace slcmap
