// Long commands show how far they are on a terminal, and Ctrl-C ends them soon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "mapping/map/map_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"
#include "tests/testing/scanned_map.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AnyOf;
using ::testing::Eq;
using ::testing::HasSubstr;
using testing::InterruptAfter;
using ::testing::Not;
using testing::ProcessResult;
using testing::RunSlcmap;
using testing::TempFolder;

// Early, and in the midst of things; by the later ones a quick machine may be done.
void ExpectEndsSoon(const std::string& arguments, const std::string& output) {
  for (const double delay_s : {0.2, 0.7, 1.5, 3.0}) {
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
    folder_ = new TempFolder;
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

  static void TearDownTestSuite() { delete folder_; }

  static std::string Path(const std::string& name) { return folder_->Path(name); }

  static TempFolder* folder_;
};

TempFolder* LongMap::folder_ = nullptr;

TEST_F(LongMap, MergeEndsSoon) {
  const std::string command = "merge " + Path("a") + " " + Path("b") + " -o " + Path("merged");
  ExpectEndsSoon(command, Path("merged"));
  // By itself it ends well, on a machine that is quick enough to be done before the last Ctrl-C
  // too.
  const ProcessResult whole = RunSlcmap(command);
  EXPECT_EQ(whole.exit_code, 0) << whole.error;
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
  // Reading and measuring what is kept.
  for (const double delay_s : {0.2, 0.5}) {
    const ProcessResult result = InterruptAfter(fmt::format("sleep {}", delay_s), command);
    EXPECT_THAT(result.exit_code, AnyOf(130, 0)) << result.error;
  }
  EXPECT_THAT(RunSlcmap(command).error, HasSubstr("kept from before"));
}

}  // namespace
}  // namespace slcmap
