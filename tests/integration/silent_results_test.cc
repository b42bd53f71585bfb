// Commands that would give a figure of nothing, or replace what they read, say so instead.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "odometry/run/run_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/edge_walk.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ExpectError;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::ReadText;
using testing::RunSlcmap;
using testing::TempFolder;

// A run over a walk past some edges, and its true poses.
class EvaluatedWalk : public ::testing::Test {
 protected:
  EvaluatedWalk() {
    WriteRunFolder(run_, testing::RunOver(kWalk));
    WriteTumTrajectory(truth_, kWalk);
  }

  ProcessResult Evaluate(const std::string& more) const {
    return RunSlcmap("evaluate --truth " + truth_ + " --estimate " + run_ + "/trajectory.tum " +
                     more);
  }

  const Trajectory kWalk = testing::Walk(40);
  TempFolder folder_;
  const std::string run_ = folder_.Path("run"), truth_ = folder_.Path("truth.tum");
};

TEST_F(EvaluatedWalk, ObservationsOfAnotherRecordingAreNamed) {
  const ProcessResult right = Evaluate("--observations " + run_);
  EXPECT_EQ(right.exit_code, 0) << right.error;
  EXPECT_THAT(right.output, HasSubstr("each placed alone: 0.0"));

  OdometryRun other = testing::RunOver(kWalk);
  for (Keyframe& keyframe : other.keyframes) keyframe.stamp_ns += ToNanoseconds(1000);
  for (OnlineState& state : other.states) state.stamp_ns += ToNanoseconds(1000);
  WriteRunFolder(folder_.Path("other"), other);
  const std::string json = folder_.Path("figures.json");
  const ProcessResult wrong =
      Evaluate("--observations " + folder_.Path("other") + " --json " + json);
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.error, AllOf(HasSubstr("other: found no keyframe at whose stamp"),
                                 HasSubstr("(keyframes: 40 of 1000.000 to 1019.500 s; estimated "
                                           "poses: 40 of 0.000 to 19.500 s"),
                                 HasSubstr("expected a run of the same recording and clock")));
  EXPECT_FALSE(std::filesystem::exists(json));
}

TEST_F(EvaluatedWalk, NothingThatIsReadIsReplaced) {
  const std::string truth = ReadText(truth_), summary = ReadText(run_ + "/run.json");
  ExpectError(Evaluate("--json " + truth_), 2, "--json: found " + truth_ + ", which is read");
  ExpectError(Evaluate("--json " + run_ + "/run.json"), 2, "which lies in a run (");
  ExpectError(Evaluate("--json " + run_ + "/deeper/figures.json"), 2, "which lies in a run (");
  ExpectError(Evaluate("--plots " + run_), 2, "--plots: found " + run_ + ", which lies in a run");
  folder_.Write("unfinished/journal/header.json", "");
  ExpectError(Evaluate("--plots " + folder_.Path("unfinished/plots")), 2, "which lies in a run (");
  folder_.Write("map/map.json", "");
  folder_.Write("map/points.ply", "");
  ExpectError(Evaluate("--json " + folder_.Path("map/x.json")), 2, "which lies in a map (");
  folder_.Write("seq/mav0/cam0/data.csv", "");
  ExpectError(Evaluate("--json " + folder_.Path("seq/mav0/cam0/data.csv")), 2,
              "which lies in a recording (");
  ExpectError(Evaluate("--plots " + folder_.Path("seq/plots")), 2, "which lies in a recording (");
  EXPECT_EQ(ReadText(truth_), truth);
  EXPECT_EQ(ReadText(run_ + "/run.json"), summary);
  EXPECT_FALSE(std::filesystem::exists(run_ + "/top.svg"));
  folder_.Write("comparison/compare.json", R"({"format": "slcmap comparison"})");
  ExpectError(Evaluate("--json " + folder_.Path("comparison/evaluate.json")), 2,
              "which lies in a comparison (");
  folder_.Write("run.json", "{}");  // of something else
  const std::string again =
      "--json " + folder_.Path("figures.json") + " --plots " + folder_.Path("plots");
  EXPECT_EQ(Evaluate(again).exit_code, 0);
  EXPECT_EQ(Evaluate(again).exit_code, 0);
}

TEST_F(EvaluatedWalk, FoldersOfAnotherKindAreNamed) {
  EXPECT_EQ(RunSlcmap("map " + run_ + " --sparse -o " + folder_.Path("map")).exit_code, 0);
  ExpectError(Evaluate("--map " + run_), 1, "run: found a run folder, expected a map folder");
  ExpectError(Evaluate("--observations " + folder_.Path("map")), 1,
              "map: found a map folder, expected a run folder");
}

TEST_F(EvaluatedWalk, FiguresOfAMapWithoutPointsAreNull) {
  EXPECT_EQ(RunSlcmap("map " + run_ + " --sparse -o " + folder_.Path("map")).exit_code, 0);
  const std::string json = folder_.Path("figures.json");
  const ProcessResult result = Evaluate("--map " + folder_.Path("map") + " --json " + json);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(result.output, AllOf(HasSubstr("flatness  too few points near each other"),
                                   HasSubstr("walls     none with points enough")));
  const auto map = nlohmann::json::parse(ReadText(json))["map"];
  EXPECT_TRUE(map["flatness"].is_null());
  EXPECT_TRUE(map["survey"]["lean_median_m"].is_null());
  EXPECT_TRUE(map["survey"]["distance_bound_95_median_m"].is_null());
}

}  // namespace
}  // namespace slcmap
