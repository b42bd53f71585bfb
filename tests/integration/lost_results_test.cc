// No command loses what it did not make, or what is worth more than what it has made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "odometry/run/run_folder.h"
#include "tests/integration/made_map.h"
#include "tests/testing/edge_walk.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::ReadText;
using testing::RunSlcmap;
using testing::TempFolder;

class LostResults : public testing::MadeMap {
 protected:
  LostResults() {
    OdometryRun partial = testing::MakeWallRun();
    partial.complete = false;
    partial.partial_reason = "interrupted";
    WriteRunFolder(partial_, partial);
  }

  const std::string partial_ = folder_.Path("partial");
};

TEST_F(LostResults, APartialMapIsPutBesideACompleteOne) {
  const std::string summary = ReadText(map_ + "/map.json");
  const ProcessResult mapped = ExpectSuccess("-q map " + partial_ + " -o " + map_);
  EXPECT_THAT(mapped.error, AllOf(HasSubstr("the run is partial: interrupted"),
                                  HasSubstr("map: partial results do not replace complete ones: "
                                            "those are in " +
                                            map_ + "/previous-1 now")));
  EXPECT_EQ(ReadText(map_ + "/previous-1/map.json"), summary);
  EXPECT_THAT(ReadText(map_ + "/map.json"), HasSubstr("\"complete\": false"));
  ExpectSuccess("-q map " + run_ + " -o " + map_);
  EXPECT_EQ(ReadText(map_ + "/map.json"), summary);
  EXPECT_FALSE(fs::exists(map_ + "/previous-1"));
}

TEST_F(LostResults, TheExportOfAPartialMapIsPutBesideThatOfACompleteOne) {
  const std::string out = folder_.Path("export");
  ExpectSuccess("-q map " + partial_ + " -o " + folder_.Path("part"));
  ExpectSuccess("-q export " + map_ + " -o " + out + " --format ply");
  const std::string summary = ReadText(out + "/export.json");
  const ProcessResult partial =
      ExpectSuccess("-q export " + folder_.Path("part") + " -o " + out + " --format ply");
  EXPECT_THAT(partial.error, HasSubstr("the map is partial: interrupted"));
  EXPECT_EQ(ReadText(out + "/previous-1/export.json"), summary);
  ExpectSuccess("-q export " + map_ + " -o " + out + " --format ply");
  EXPECT_FALSE(fs::exists(out + "/previous-1"));
}

TEST_F(LostResults, ARefusedRunRemovesNothingAndLeavesNothing) {
  const std::string page = folder_.Write(
      "out/map.html",
      "<!doctype html><title>slcmap</title><script id=\"map\" type=\"text/plain\"></script>");
  ExpectError("run " + folder_.Path("none") + " -o " + folder_.Path("out"), 1, "none");
  EXPECT_TRUE(fs::exists(page));
  ExpectError("run " + folder_.Path("none") + " -o " + folder_.Path("deep/new"), 1, "none");
  EXPECT_FALSE(fs::exists(folder_.Path("deep")));
}

TEST_F(LostResults, WhatIsTheUsersStopsACommandBeforeItBegins) {
  testing::WriteSequence(folder_, {});
  const std::string page = folder_.Write("out/map.html", "<!doctype html> notes");
  ExpectError("run " + folder_.Path("mav0") + " -o " + folder_.Path("out"), 2,
              "map.html: found a file that is no page of a map by slcmap");
  EXPECT_EQ(ReadText(page), "<!doctype html> notes");
  EXPECT_FALSE(fs::exists(folder_.Path("out/run")));
  const std::string summary = folder_.Write("mine/run.json", "x");
  ExpectError("odometry " + folder_.Path("mav0") + " -o " + folder_.Path("mine"), 2,
              "found run.json, which is not of a run");
  EXPECT_EQ(ReadText(summary), "x");
  for (const char* command : {"run ", "odometry ", "compare "}) {
    ExpectError(command + folder_.Path() + " -o " + folder_.Path("x"), 2,
                "nothing is written into what is read");
    EXPECT_FALSE(fs::exists(folder_.Path("x"))) << command;
  }
}

TEST_F(LostResults, APageReplacesNothingButAPage) {
  const std::string view = "view " + map_ + " -o ", pipe = folder_.Path("pipe");
  const std::string mine = folder_.Write("mine.html", "<!doctype html> notes");
  ExpectError(view + mine, 2, "found a file that is no page");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  ExpectError(view + pipe, 2, "pipe: found a pipe, expected a file");
  EXPECT_TRUE(fs::is_fifo(pipe));
  ExpectError(view + "/dev/null", 2, "/dev/null: found a device, expected a file");
  fs::create_symlink(mine, folder_.Path("link.html"));
  ExpectError(view + folder_.Path("link.html"), 2, "found a file that is no page");
  fs::create_symlink(map_ + "/new.html", folder_.Path("into.html"));
  ExpectError(view + folder_.Path("into.html"), 2, "nothing is written into what");
  EXPECT_EQ(ReadText(mine), "<!doctype html> notes");
}

TEST_F(LostResults, WhatIsReadIsNotReplaced) {
  testing::WriteSequence(folder_, {});
  const std::string posed = "map " + folder_.Path("mav0") + " --poses " + map_ + "/trajectory.tum";
  const std::string poses = ReadText(map_ + "/trajectory.tum");
  ExpectError(posed + " -o " + map_, 2, "it would be replaced");
  EXPECT_EQ(ReadText(map_ + "/trajectory.tum"), poses);
  ExpectError("map " + run_ + " --config " + map_ + "/options.yaml -o " + map_, 2,
              "options.yaml in it, expected another folder");
  const std::string rig = folder_.Write("run/rig.json", ReadText(run_ + "/rig.json"));
  ExpectError(
      RunSlcmap("odometry " + folder_.Path("mav0") + " --calibration " + rig + " -o " + run_), 2,
      "rig.json in it, expected another folder");
  ExpectError("merge " + map_ + " " + map_ + " -o " + map_, 2, "found the input");
}

// Commands that would give a figure of nothing, or replace what they read, say so instead.

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

TEST_F(EvaluatedWalk, NothingThatIsReadIsReplaced) {
  const std::string truth = ReadText(truth_), summary = ReadText(run_ + "/run.json");
  ExpectError(Evaluate("--json " + truth_), 2, "--json: found " + truth_ + ", which is read");
  ExpectError(Evaluate("--json " + run_ + "/run.json"), 2, "which lies in a run (");
  ExpectError(Evaluate("--json " + run_ + "/deeper/figures.json"), 2, "which lies in a run (");
  folder_.Write("unfinished/journal/header.json", "");
  ExpectError(Evaluate("--json " + folder_.Path("unfinished/figures.json")), 2,
              "which lies in a run (");
  folder_.Write("map/map.json", "");
  folder_.Write("map/points.ply", "");
  ExpectError(Evaluate("--json " + folder_.Path("map/x.json")), 2, "which lies in a map (");
  folder_.Write("seq/mav0/cam0/data.csv", "");
  ExpectError(Evaluate("--json " + folder_.Path("seq/mav0/cam0/data.csv")), 2,
              "which lies in a recording (");
  EXPECT_EQ(ReadText(truth_), truth);
  EXPECT_EQ(ReadText(run_ + "/run.json"), summary);
  folder_.Write("comparison/compare.json", R"({"format": "slcmap comparison"})");
  ExpectError(Evaluate("--json " + folder_.Path("comparison/evaluate.json")), 2,
              "which lies in a comparison (");
  folder_.Write("run.json", "{}");  // of something else
  const std::string again = "--json " + folder_.Path("figures.json");
  EXPECT_EQ(Evaluate(again).exit_code, 0);
  EXPECT_EQ(Evaluate(again).exit_code, 0);
}

}  // namespace
}  // namespace slcmap
