// slcmap evaluate, as a user calls it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/io/map_line.h"
#include "odometry/run/run_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"
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

TEST(EvaluateCommand, PrintsTheTableAndWritesJson) {
  const TempFolder folder;
  OdometryRun run = testing::MakeWallRun();
  WriteRunFolder(folder.Path("run"), run);
  ExpectSuccess("map " + folder.Path("run") + " -o " + folder.Path("map"));
  const ProcessResult result =
      ExpectSuccess("evaluate --truth " + folder.Path("map/trajectory.tum") + " --estimate " +
                    folder.Path("run/trajectory.tum") + " --json " + folder.Path("metrics.json"));
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("posyaw"), HasSubstr("truth_length_m             5\n")));
  const auto json = nlohmann::json::parse(testing::ReadText(folder.Path("metrics.json")));
  EXPECT_EQ(json["coverage"]["overall"], 1.0);
  // The drift of 2 cm a second, of which the yaw takes the most.
  EXPECT_NEAR(json["ape"]["posyaw"]["position_m"]["rmse"].get<double>(), 0.0046, 0.001);
}

TEST(EvaluateCommand, LinesAreMeasuredWhereTheTrajectoryLiesOnTheTruth) {
  const TempFolder folder;
  const std::string run = folder.Path("run");
  OdometryRun made = testing::MakeLineRun();
  for (OnlineState& state : made.states) state.T_world_imu.translation.y() = 0;
  WriteRunFolder(run, made);
  // The true world lies 3 m beside that of the run; the four lines along y are no true edges.
  std::string truth, edges = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m\n";
  for (const OnlineState& state : made.states) {
    RigidTransform pose = state.T_world_imu;
    pose.translation.y() += 3;
    truth += TumRow({state.stamp_ns, pose});
  }
  for (int i = 0; i < 20; ++i) {
    edges +=
        fmt::format("{0},2,0,10.02,{1:.2f},0.02,10.02,{1:.2f},1.92,0,1.9\n", i, 0.2 * i + 1.12);
  }
  const std::string command = "evaluate --truth " + folder.Write("truth.tum", truth) +
                              " --estimate " + run + "/trajectory.tum --lines " + run +
                              "/lines.ply --true-edges " + folder.Write("edges.csv", edges);
  const ProcessResult result = ExpectSuccess(command + " --json " + folder.Path("metrics.json"));
  EXPECT_THAT(result.output, HasSubstr("mapped_length_m      53.2\n"));
  const auto json = nlohmann::json::parse(testing::ReadText(folder.Path("metrics.json")));
  EXPECT_NEAR(json["lines"]["scores"][0]["recall"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(json["lines"]["scores"][2]["precision"].get<double>(), 38 / 53.2, 1e-6);
  EXPECT_EQ(json["ape"].size(), 3u);

  ExpectError("evaluate --truth a --estimate b --lines c", 2, "--true-edges");
  folder.Write("edges.csv", "none\n");
  const ProcessResult damaged = RunSlcmap(command);
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.error, HasSubstr("edges.csv: row 1"));
}

// A map is turned along the building, its run is not.
TEST(EvaluateCommand, LinesOfAMapAreMeasuredByItsPosesAndByThoseOfItsRun) {
  const TempFolder folder;
  const std::string run = folder.Path("run"), map = folder.Path("map");
  OdometryRun made = testing::MakeLineRun();
  for (OnlineState& state : made.states) state.T_world_imu.translation.y() = 0;
  made.manhattan_worlds[0].heading_rad = 0.2;
  WriteRunFolder(run, made);
  ExpectSuccess("map " + run + " -o " + map);
  const std::vector<MapLine> in_run = ReadMapLines(run + "/lines.ply"),
                             in_map = ReadMapLines(map + "/lines.ply");
  ASSERT_EQ(in_run.size(), in_map.size());
  EXPECT_NEAR((in_run[0].start_world - in_map[0].start_world).norm(),
              2 * std::sin(0.1) * in_run[0].start_world.head<2>().norm(), 1e-4);
  ExpectSuccess("export " + map + " -o " + folder.Path("export") + " --format ply");
  const auto precision = [&](const std::string& trajectory, const std::string& lines) {
    const ProcessResult result = ExpectSuccess(
        "evaluate --truth " + run + "/trajectory.tum --estimate " + trajectory + " --lines " +
        lines + " --true-edges " + run + "/lines.ply --json " + folder.Path("metrics.json"));
    const auto json = nlohmann::json::parse(testing::ReadText(folder.Path("metrics.json")));
    return std::pair(json["lines"]["scores"][0]["precision"].get<double>(), result.error);
  };
  for (const std::string& of : {run, map}) {
    for (const std::string& lines : {map, folder.Path("export")}) {
      EXPECT_NEAR(precision(of + "/trajectory.tum", lines + "/lines.ply").first, 1, 1e-9)
          << of << lines;
    }
  }
  // Of a copy it is not known what it is of.
  const auto [copied, error] = precision(
      folder.Write("poses.tum", testing::ReadText(run + "/trajectory.tum")), map + "/lines.ply");
  EXPECT_LT(copied, 0.5);
  EXPECT_THAT(error, HasSubstr("found a map that is turned by 11.46 degrees against its run"));
  // A file of that name may be of another program.
  folder.Write("map.json", "{}");
  EXPECT_THAT(precision(folder.Path("poses.tum"), map + "/lines.ply").second,
              HasSubstr("of which world the files beside it are is not known"));
}

class EvaluateLongLines : public ::testing::Test {
 protected:
  // Evaluates a made run whose lines are edges of that length, with `more` arguments.
  std::string Command(const char* length_m, const std::string& more) const {
    const std::string run = folder_.Path("run");
    WriteRunFolder(run, testing::MakeLineRun());
    const std::string lines = folder_.Write(
        "long.ply", fmt::format("ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\n"
                                "property double y\nproperty double z\nelement edge 1\n"
                                "property int vertex1\nproperty int vertex2\nend_header\n"
                                "0 0 0\n{} 0 0\n0 1\n",
                                length_m));
    return "-v evaluate --truth " + run + "/trajectory.tum --estimate " + run +
           "/trajectory.tum --lines " + lines + " --true-edges " + lines + more;
  }

  TempFolder folder_;
};

TEST_F(EvaluateLongLines, TooManySamplesAreRefusedWithTheirNumber) {
  const ProcessResult result = RunSlcmap(Command("1e6", ""));
  EXPECT_EQ(result.exit_code, 1) << result.error;
  EXPECT_THAT(result.error, AllOf(HasSubstr("long.ply"), HasSubstr("1e+06 m of edges"),
                                  HasSubstr("expected at most 10000000 samples")));
}

TEST_F(EvaluateLongLines, CtrlCLeavesTheTrajectorysFigures) {
  const std::string json = folder_.Path("metrics.json");
  const ProcessResult result = testing::InterruptSlcmap(
      Command("3e5", " --max-samples 1000000000 --json " + json), "1 true edges");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_THAT(result.output, HasSubstr("posyaw"));
  EXPECT_THAT(testing::ReadText(json),
              AllOf(HasSubstr("posyaw"), HasSubstr("\"partial_reason\": \"interrupted\"")));
}

TEST(EvaluateCommand, StampsOfImagesAreFoundOrGiven) {
  const TempFolder folder;
  const std::string truth = folder.Write("mav0/state_groundtruth_estimate0/data.csv",
                                         "0,0,0,0,1,0,0,0\n100000000,1,0,0,1,0,0,0\n"
                                         "200000000,2,0,0,1,0,0,0\n300000000,3,0,0,1,0,0,0\n");
  const std::string command = "evaluate --truth " + truth + " --estimate " + truth;
  EXPECT_THAT(RunSlcmap(command).output, HasSubstr("stamps " + truth + "  overall 1 "));
  folder.Write("mav0/cam0/data.csv", "#timestamp [ns],filename\n0,0.png\n200000000,2.png\n");
  EXPECT_THAT(RunSlcmap(command).output, HasSubstr("mav0/cam0/data.csv"));
  const std::string stamps = folder.Write("stamps.csv", "0\n100000000\n900000000\n950000000\n");
  EXPECT_THAT(RunSlcmap(command + " --stamps " + stamps).output,
              HasSubstr("stamps.csv  overall 0.5 "));
  folder.Write("stamps.csv", "0\n0\n");
  ExpectError(command + " --stamps " + stamps, 1, "stamps.csv: row 2: found '0'");
}

TEST(EvaluateCommand, ErrorsNameThePlace) {
  const TempFolder folder;
  const std::string a =
      folder.Write("a.tum", "1.0 0 0 0 0 0 0 1\n1.1 1 0 0 0 0 0 1\n1.2 1 1 0 0 0 0 1\n");
  const std::string b =
      folder.Write("b.tum", "5.0 0 0 0 0 0 0 1\n5.1 0 0 0 0 0 0 1\n5.2 0 0 0 0 0 0 1\n");
  const std::string bad = folder.Write("bad.tum", "1.0 0 0 0 0 0 0 1\n1.1 x 0 0 0 0 0 1\n");
  const std::string huge = folder.Write("huge.tum", "");
  std::filesystem::resize_file(huge, 400000000);  // of no blocks
  WriteRunFolder(folder.Path("run"), testing::MakeWallRun());
  const struct {
    std::string arguments;
    int exit_code;
    std::string words;
  } kWrong[] = {
      {a, 2, "evaluate: found no --estimate"},
      {a + " --estimate " + folder.Path("none.tum"), 1, "none.tum"},
      {a + " --estimate " + bad, 1, "bad.tum: row 2"},
      {a + " --estimate " + b, 1, "b.tum against " + a + ": found 0 of 3"},
      {a + " --estimate " + a + " --max-truth-gap 0", 2,
       "--max-truth-gap: found 0, expected more than 0 s"},
      {a + " --estimate " + a + " --json /dev/full", 1, "/dev/full: cannot be written"},
      {folder.Path("run") + " --estimate " + a, 1,
       "run: found a folder, expected a trajectory file"},
      {huge + " --estimate " + a, 1, "found 400000000 bytes, expected at most 300000000"}};
  for (const auto& wrong : kWrong) {
    SCOPED_TRACE(wrong.arguments);
    ExpectError("evaluate --truth " + wrong.arguments, wrong.exit_code, wrong.words);
  }
  const std::string lost =
      folder.Write("lost.tum", "1.0 0 0 0 0 0 0 1\n1.1 nan 0 0 0 0 0 1\n1.2 1 1 0 0 0 0 1\n");
  EXPECT_THAT(RunSlcmap("evaluate --truth " + a + " --estimate " + lost).error,
              HasSubstr("lost.tum: 1 rows hold no numbers (NaN), first row 2, and are left out"));
}

}  // namespace
}  // namespace slcmap
