// The command line: exit codes and one-line messages that name the place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/slcmap_process.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::RunShell;
using testing::RunSlcmap;
using ::testing::StartsWith;
using testing::TempFolder;

// One line, in the form of every error.
void ExpectError(const ProcessResult& result, int exit_code, const std::string& part) {
  EXPECT_EQ(result.exit_code, exit_code) << result.error;
  EXPECT_EQ(result.ErrorLines(), 1) << result.error;
  EXPECT_THAT(result.error, AllOf(StartsWith("slcmap: error: "), HasSubstr(part)));
}

TEST(CommandLine, HelpAndVersionSucceed) {
  EXPECT_EQ(RunSlcmap("--version").exit_code, 0);
  const ProcessResult help = RunSlcmap("odometry --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.output, HasSubstr("Examples:"));
  EXPECT_THAT(RunSlcmap("--help").output, HasSubstr("odometry"));
}

TEST(CommandLine, UsageErrorsAreTwo) {
  ExpectError(RunSlcmap(""), 2, "subcommand is required");
  ExpectError(RunSlcmap("fly"), 2, "found command 'fly'");
  ExpectError(RunSlcmap("odometry"), 2, "sequence is required");
  ExpectError(RunSlcmap("odometry seq -o run --threads many"), 2, "--threads");
  ExpectError(RunSlcmap("odometry seq -o run --threads 0"), 2, "--threads: found 0");
  ExpectError(RunSlcmap("odometry seq -o run --threads 100000"), 2, "--threads: found 100000");
}

TEST(CommandLine, AFullStandardOutputIsAnError) {
  ExpectError(RunShell("\\$SLCMAP --version > /dev/full"), 1, "standard output: cannot be written");
}

TEST(Odometry, ErrorsNameThePlace) {
  const TempFolder folder;
  const std::string run = " -o " + folder.Path("run");
  ExpectError(RunSlcmap("odometry " + folder.Path("none") + run), 1, "none: found no such folder");
  testing::WriteSequence(folder, {.images = 2});
  const std::string sequence = "odometry " + folder.Path() + run;
  ExpectError(RunSlcmap(sequence + " --method slc"), 2, "points or points-mono");
  folder.Write("bad.yaml", "window: {max_keyfraems: 3}\n");
  ExpectError(RunSlcmap(sequence + " --config " + folder.Path("bad.yaml")), 2,
              "bad.yaml: window.max_keyfraems: unknown key");
  ExpectError(RunSlcmap(sequence + " --config " + folder.Path("none.yaml")), 2, "none.yaml");
  ExpectError(RunSlcmap(sequence + " --calibration " + folder.Path("bad.yaml")), 1,
              "bad.yaml: cam0: missing");
  ExpectError(RunSlcmap("-q odometry " + folder.Path() + " -o /proc/run"), 1, "/proc/run");
}

TEST(Odometry, ASequenceThatShowsNoMotionFailsAndSaysSo) {
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 5});
  const ProcessResult result =
      RunSlcmap("-q odometry " + folder.Path() + " -o " + folder.Path("run"));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.error, HasSubstr("found no motion that could be estimated"));
  EXPECT_TRUE(std::filesystem::exists(folder.Path("run/run.json")));
}

TEST(Check, ASequenceOfNoUseFailsAfterTheReport) {
  const TempFolder folder;
  const ProcessResult result = RunSlcmap("check " + folder.Path());
  ExpectError(result, 1, "not usable");
  EXPECT_THAT(result.output, HasSubstr("remedy: "));
  EXPECT_THAT(RunSlcmap("check --json " + folder.Path()).output, HasSubstr("\"usable\": false"));
}

class StillRig : public ::testing::Test {
 protected:
  void Write(int images) {
    testing::WriteSequence(folder_, {.images = images, .size = {320, 240}, .still = true});
  }
  std::string Command() const {
    return "odometry " + folder_.Path() + " -o " + folder_.Path("run");
  }
  int Rows() const {
    int rows = -1;  // without the header
    for (const char c : testing::ReadText(folder_.Path("run/trajectory.tum"))) rows += c == '\n';
    return rows;
  }
  std::string Summary() const { return testing::ReadText(folder_.Path("run/run.json")); }

  TempFolder folder_;
};

TEST_F(StillRig, StaysWhereItIsDespiteDamagedImages) {
  Write(60);
  for (const int index : {30, 31, 45}) {
    std::filesystem::remove(
        folder_.Path(fmt::format("mav0/cam1/data/{}.png", testing::ImageStamp(index))));
  }
  const ProcessResult result = RunSlcmap(Command());
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_GT(Rows(), 35);
  EXPECT_THAT(result.error, HasSubstr("images missing"));
  EXPECT_THAT(Summary(),
              AllOf(HasSubstr("\"complete\": true"), HasSubstr("\"images_missing\": 3")));
  EXPECT_THAT(result.error, HasSubstr("path 0.0"));
}

TEST_F(StillRig, RunsThroughAllStages) {
  Write(40);
  const ProcessResult result = RunSlcmap("-q run " + folder_.Path() + " -o " + folder_.Path("out"));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  for (const char* file : {"run/trajectory.tum", "map/trajectory.tum", "export/scene.glb"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.Path(std::string("out/") + file))) << file;
  }
  EXPECT_THAT(result.output, AllOf(HasSubstr("cost "), HasSubstr("out/export/scene.glb")));
}

TEST_F(StillRig, CtrlCLeavesTheResultsSoFar) {
  Write(2000);
  const ProcessResult result = RunShell(
      "\\$SLCMAP " + Command() + " & pid=\\$!; for i in {1..100}; do sleep 0.1; [ \\$(cat " +
      folder_.Path("run/trajectory.tum") +
      " 2>/dev/null | wc -l) -gt 10 ] && break; done; kill -TERM \\$pid; wait \\$pid");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_GT(Rows(), 9);
  EXPECT_LT(Rows(), 1990);
  EXPECT_THAT(Summary(), AllOf(HasSubstr("\"complete\": false"), HasSubstr("interrupted")));
}

TEST_F(StillRig, ADiskThatFillsUpHalfWayLeavesTheResultsSoFar) {
  Write(60);
  // No file may grow beyond 2 KiB.
  const ProcessResult result = RunShell("trap '' XFSZ; ulimit -f 2; \\$SLCMAP -q " + Command() +
                                        " 2>&1 | cat >&2; exit "
                                        "\\${PIPESTATUS[0]}");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.error, AllOf(StartsWith("slcmap: error: "), HasSubstr("run/trajectory.tum"),
                                  HasSubstr("cannot be written")));
  EXPECT_GT(Rows(), 5);
  EXPECT_THAT(Summary(), HasSubstr("\"complete\": false"));
}

}  // namespace
}  // namespace slcmap
