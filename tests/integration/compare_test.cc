// slcmap compare, as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "data/io/ply.h"
#include "mapping/map/map_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"
#include "tests/testing/scanned_map.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Eq;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using testing::InterruptAfter;
using ::testing::Not;
using testing::ProcessResult;
using testing::RunSlcmap;
using testing::TempFolder;

class CompareTest : public ::testing::Test {
 protected:
  CompareTest() { testing::WriteSequence(sequence_, {}); }

  ProcessResult Compare(const std::string& arguments) const {
    return RunSlcmap("compare " + sequence_.Path() + " -o " + folder_.Path("report") + " " +
                     arguments);
  }

  TempFolder sequence_, folder_;
};

TEST_F(CompareTest, WrongUsageIsToldBeforeAnythingRuns) {
  const std::string empty = folder_.Write("few.yaml", ""),
                    wrong = folder_.Write("wrong.yaml", "point: 3\n");
  const std::pair<std::string, std::string> kWrong[] = {
      {"--methods beauty", "beauty"},
      {"--methods slc,slc", "slc twice"},
      {"--repeats 0", "--repeats: found 0"},
      {"--with orbslam", "expected NAME=file"},
      {"--with orbslam=nowhere.tum", "nowhere.tum"},
      {"--variant a/b=" + empty, "without '/'"},
      {"--variant few=" + wrong, "point"}};
  for (const auto& [arguments, words] : kWrong) {
    SCOPED_TRACE(arguments);
    ExpectError(Compare(arguments), 2, words);
  }
  ExpectError("compare " + folder_.Path() + " -o " + folder_.Path("report"), 1, folder_.Path());
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("report/compare.json")));
}

// A run without a pose is a whole result too, and quick to have.
TEST_F(CompareTest, RunsAreKeptWhileProgramAndImagesAreTheSame) {
  const ProcessResult first = Compare("--methods points");
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_THAT(first.error, AllOf(HasSubstr("no method gave a result"), Not(HasSubstr("kept"))));
  EXPECT_THAT(first.output, HasSubstr("points: a run has no pose at all"));
  EXPECT_TRUE(std::filesystem::exists(folder_.Path("report/report.html")));
  EXPECT_THAT(Compare("--methods points").error,
              AllOf(HasSubstr("points-0-"), HasSubstr("kept from before")));
  // Another build of the same version.
  const std::string other = folder_.Path("other_slcmap");
  const ProcessResult rebuilt = testing::RunShell(
      "cp \\$SLCMAP " + other + " && echo >> " + other + " && " + other + " compare " +
      sequence_.Path() + " -o " + folder_.Path("report") + " --methods points");
  EXPECT_THAT(rebuilt.error, AllOf(HasSubstr("no method gave a result"), Not(HasSubstr("kept"))));
  // The same names and tables, another image.
  const std::string image =
      sequence_.Path(fmt::format("mav0/cam1/data/{}.png", testing::ImageStamp(2)));
  std::ofstream(image, std::ios::binary | std::ios::app) << " ";
  EXPECT_THAT(Compare("--methods points").error, Not(HasSubstr("kept")));
}

TEST_F(CompareTest, DamagedRunsAreMadeAnew) {
  Compare("--methods points");
  const std::string runs = folder_.Path("report/runs");
  std::string folder;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(runs)) {
    if (entry.path().filename() == "run.json") folder = entry.path().parent_path().parent_path();
  }
  ASSERT_NE(folder, "");
  std::ofstream(folder + "/run/imu.csv", std::ios::app) << "1,2,damaged\n";
  const ProcessResult run = Compare("--methods points");
  EXPECT_THAT(run.error, AllOf(HasSubstr(folder + "/run: found damaged what was kept from before"),
                               Not(HasSubstr("--accept-changed"))));
  EXPECT_THAT(run.output, HasSubstr("points: a run has no pose at all"));
  EXPECT_THAT(Compare("--methods points").error, Not(HasSubstr("damaged")));

  std::ofstream(folder + "/map/map.json") << "{";
  EXPECT_THAT(Compare("--methods points").error, HasSubstr(folder + "/map: found damaged"));
  // What is left without its summary would be taken for files of another.
  std::filesystem::remove(folder + "/map/map.json");
  const ProcessResult map = Compare("--methods points");
  EXPECT_THAT(map.output,
              AllOf(HasSubstr("points: a run has no pose at all"), Not(HasSubstr("run 1 failed"))));
  EXPECT_TRUE(std::filesystem::exists(folder + "/map/map.json"));
}

// Maps by any system: the points of a room every 4 cm.
class CompareMapsTest : public ::testing::Test {
 protected:
  CompareMapsTest() {
    std::string rows;
    const auto add = [&](double u_m, double v_m, auto place) {
      for (double u = 0.02; u < u_m; u += 0.04) {
        for (double v = 0.02; v < v_m; v += 0.04) rows += place(u, v) + "\n";
      }
    };
    for (const double at : {0.0, 1.0}) {
      add(4, 2.6, [&](double u, double v) { return fmt::format("{} {} {}", u, 3 * at, v); });
      add(3, 2.6, [&](double u, double v) { return fmt::format("{} {} {}", 4 * at, u, v); });
      add(4, 3, [&](double u, double v) { return fmt::format("{} {} {}", u, v, 2.6 * at); });
    }
    room_ = folder_.Write("room.xyz", rows);
    damaged_ = folder_.Write("damaged.ply", "ply\nformat ascii 1.0\n");
  }

  TempFolder folder_;
  std::string room_, damaged_;
};

TEST_F(CompareMapsTest, TheSameCommandReplacesItsReport) {
  const std::string report = folder_.Path("report");
  const std::string command = "compare --maps a=" + room_ + " b=" + room_ + " -o " + report;
  ExpectSuccess(command);
  const std::string json = testing::ReadText(report + "/maps.json");
  EXPECT_THAT(ExpectSuccess(command).output, HasSubstr("a and b 0.00 mm"));
  EXPECT_EQ(testing::ReadText(report + "/maps.json"), json);
}

TEST_F(CompareMapsTest, OneThatCannotBeReadLeavesTheOthersTheirFigures) {
  const std::string maps = "--maps damaged=" + damaged_ + " a=" + room_;
  const std::string report = folder_.Path("report"), figures = folder_.Path("maps.json");
  // The figures of evaluate are a file among others, and written again.
  for (const std::string& command :
       {"compare " + maps + " -o " + report, "evaluate " + maps + " --json " + figures,
        "evaluate " + maps + " --json " + figures}) {
    const ProcessResult result = RunSlcmap(command);
    EXPECT_EQ(result.exit_code, 1) << result.error;
    EXPECT_THAT(result.error, HasSubstr("damaged.ply: PLY header"));
    EXPECT_THAT(result.output, HasSubstr("their length [m]"));
  }
  EXPECT_THAT(testing::ReadText(report + "/maps.csv"), HasSubstr("a,walls,4"));
  EXPECT_THAT(testing::ReadText(figures), HasSubstr("\"walls\": 4"));
}

TEST_F(CompareMapsTest, SinglePrecisionFarFromTheOriginIsTold) {
  PlyElement vertices{"vertex", {}};
  for (const char* axis : {"x", "y", "z"}) vertices.Add(axis, PlyType::kFloat);
  for (int i = 0; i < 100; ++i) vertices.AppendRow({5e5 + i, 5.4e6, 300});
  WritePly(folder_.Path("far.ply"), {{}, {vertices}, {}});
  EXPECT_THAT(RunSlcmap("evaluate --maps far=" + folder_.Path("far.ply") + " near=" + room_).error,
              AllOf(HasSubstr("far.ply: found single-precision coordinates in steps of 0.5 m"),
                    HasSubstr("write doubles, or subtract an origin")));
}

// Long commands show how far they are on a terminal, and Ctrl-C ends them soon.

// Early, and in the midst of things; by the later ones a quick machine may be done.
void ExpectEndsSoon(const std::string& arguments, const std::string& output) {
  for (const double delay_s : {0.2, 1.0, 2.5}) {
    const ProcessResult result = InterruptAfter(fmt::format("sleep {}", delay_s), arguments);
    EXPECT_THAT(result.exit_code, AnyOf(Eq(130), Eq(delay_s < 0.5 ? 130 : 0)))
        << delay_s << " s: " << result.error;
    std::filesystem::remove_all(output);
  }
}

// What a terminal shows.
std::string OnTerminal(const std::string& arguments) {
  return testing::RunShell("script -qec \\\"\\$SLCMAP " + arguments + "\\\" /dev/null").output;
}

// Two large maps of one hall, with enough where both have been to tell how they lie.
class LongMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Scene hall = testing::SceneFromText(R"(objects:
  - {kind: slab, at: [0, 0, 0], size: [60, 8], material: carpet}
  - {kind: wall, points: [[0, 0], [60, 0], [60, 8], [0, 8]], closed: true}
  - {kind: wall, points: [[7, 8], [7, 5]]}
  - {kind: wall, points: [[19, 0], [19, 2.5], [23, 2.5]]}
  - {kind: wall, points: [[34, 8], [34, 6], [36, 6], [36, 5]]}
  - {kind: wall, points: [[51, 0], [51, 3]]}
  - {kind: box, at: [12, 1, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [28, 6, 0], size: [3.1, 1.4, 2.2]}
  - {kind: box, at: [43, 1, 0], size: [1.2, 4.6, 0.75]}
)");
    WriteMapFolder(Path("a"), testing::ScannedAlong(hall, {{{3, 3.5, 1.5}, {57, 3.5, 1.5}}}));
    WriteMapFolder(Path("b"), testing::ScannedAlong(hall, {{{57, 4.5, 1.5}, {3, 4.5, 1.5}}},
                                                    LevelTransform(0.7, {2, 1, 0.1}), "b"));
  }

  static std::string Path(const std::string& name) { return folder_.Path(name); }

  inline static const TempFolder folder_;
};

TEST_F(LongMap, MergeEndsSoon) {
  ExpectEndsSoon("merge " + Path("a") + " " + Path("b") + " -o " + Path("merged"), Path("merged"));
}

TEST_F(LongMap, ExportEndsSoon) {
  ExpectEndsSoon("export " + Path("a") + " -o " + Path("export"), Path("export"));
}

TEST_F(LongMap, ViewEndsSoon) {
  if (!std::filesystem::exists(SLCMAP_PAGE)) {
    GTEST_SKIP() << "the page was not built: it needs npm";
  }
  ExpectEndsSoon("view " + Path("a") + " -o " + Path("map.html"), Path("map.html"));
}

class LongRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    if (sequence_.empty()) GTEST_SKIP() << "needs the shared recording euroc_mh01_8s";
  }

  const std::string sequence_ = testing::SharedData("euroc_mh01_8s");
  TempFolder folder_;
};

TEST_F(LongRecording, CheckShowsABarAndEndsSoon) {
  EXPECT_THAT(OnTerminal("check " + sequence_), HasSubstr("check ["));
  EXPECT_THAT(OnTerminal("check -q " + sequence_), Not(HasSubstr("check [")));
  ExpectEndsSoon("check " + sequence_, folder_.Path("none"));
}

TEST_F(LongRecording, CompareShowsBarsEndsSoonAndKeepsWhatIsFinished) {
  const std::string report = folder_.Path("report");
  const std::string command = "compare " + sequence_ + " --methods points -o " + report;
  ExpectEndsSoon(command, report);
  EXPECT_THAT(OnTerminal(command), HasSubstr("euroc_mh01_8s runs ["));
  const std::string csv = testing::ReadText(report + "/compare.csv");
  EXPECT_THAT(csv, AllOf(HasSubstr("euroc_mh01_8s,points,ape_final_m,m,0.00"),
                         HasSubstr("points,cpu_ms_a_pair,ms,")));
  // Reading and measuring what is kept.
  EXPECT_THAT(InterruptAfter("sleep 0.4", command).exit_code, AnyOf(130, 0));
  // A trajectory that is given is measured beside the runs that are there.
  const ProcessResult second = ExpectSuccess(command + " --with truth=" + sequence_ +
                                             "/mav0/state_groundtruth_estimate0/data.csv");
  EXPECT_THAT(second.error, HasSubstr("kept from before"));
  EXPECT_THAT(testing::ReadText(report + "/compare.csv"),
              AllOf(HasSubstr(csv.substr(csv.find("euroc"))), HasSubstr(",truth,ape_final_m,m,")));
}

}  // namespace
}  // namespace slcmap
