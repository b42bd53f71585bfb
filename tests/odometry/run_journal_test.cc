#include "odometry/run/run_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/run_queries.h"
#include "tests/testing/made_run.h"
#include "tests/testing/same_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;

// A run with all that can be known of one before it ends.
OdometryRun MakeRun() {
  OdometryRun run = testing::MakeLineRun();
  run.source = testing::MakeSource(run);
  run.warnings = {{"images_missing", 5}, {"segments ended by speed", 1}};
  run.line_deviation_rad = 0.0033;
  run.figures.points_rejected = {0.1, 0.2, 30};
  run.sloped_directions = {{0, 0.25, 0.5, 0.001, 0.002, 7, false}};
  run.imu = {{1, {1, 2, 3}, {4, 5, 6}}, {2, {1, 2, 3}, {4, 5, 6}}};
  run.line_merges = {{700, 600}, {600, 103}};
  run.keyframes[5].lines[4].id = 700;  // has been 104, and turned out to be the same as 103
  for (const std::size_t keyframe : {2, 4}) {
    CalibrationEstimate& estimate = run.calibration.emplace_back();
    estimate.stamp_ns = run.keyframes[keyframe].stamp_ns;
    estimate.time_offset_s = 0.001 * static_cast<double>(keyframe);
    estimate.time_offset_sigma_s = 1e-4;
  }
  return run;
}

OdometryRun FinishedPart(const OdometryRun& run, std::size_t from, std::size_t to) {
  OdometryRun part;
  part.keyframes = {run.keyframes.begin() + from, run.keyframes.begin() + to};
  part.states = {run.states.begin() + 10 * from, run.states.begin() + 10 * to};
  part.manhattan_worlds = run.manhattan_worlds;
  part.lines = {run.lines[from]};
  part.landmarks = {run.landmarks[from]};
  if (from == 2) part.calibration = {run.calibration[0]};
  return part;
}

// What it holds of landmark 2 and of the first calibration changes before they leave it.
OdometryRun WindowOf(const OdometryRun& run, std::size_t from) {
  OdometryRun window = run;
  window.states.clear();
  window.imu.clear();
  window.landmarks[2].p_world.x() = 77;
  window.calibration[0].time_offset_s = 0.7;
  window.keyframes.erase(window.keyframes.begin(), window.keyframes.begin() + from);
  return window;
}

class RunJournalTest : public ::testing::Test {
 protected:
  RunJournalTest() {
    RunJournal journal(folder_, run_);
    OdometryRun first = FinishedPart(run_, 0, 2);
    first.imu = run_.imu;
    journal.Append(first);
    OdometryRun older = WindowOf(run_, 2);
    older.line_deviation_rad = 0.001;
    journal.SetWindow(older);
    window_before_ = ReadFile(Path("window.csv"));
    journal.Append(FinishedPart(run_, 2, 3));
    journal.SetWindow(WindowOf(run_, 3));
    verified_bytes_ = ReadFile(Path("finished.csv")).size();
    journal.Append(FinishedPart(run_, 3, 4));
  }

  std::string Path(const char* name) const { return folder_ + "/journal/" + name; }

  // Removes those rows, from 0, that start with a text.
  void RemoveRows(const char* name, const std::string& start, int from, int to) const {
    std::istringstream rows(ReadFile(Path(name)));
    std::string text;
    int found = 0;
    for (std::string row; std::getline(rows, row);) {
      const int index = row.starts_with(start) ? found++ : -1;
      if (index < from || index >= to) text += row + "\n";
    }
    ASSERT_GE(found, to);
    WriteFile(Path(name), text);
  }

  // Refuses the journal by a message that holds these, and takes it where changes are accepted.
  void ExpectRefused(const std::string& place, const std::string& what) const {
    EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }),
                AllOf(HasSubstr("journal/" + place), HasSubstr(what), HasSubstr("expected "),
                      HasSubstr("--accept-changed")));
    EXPECT_NO_THROW(ReadRunFolder(folder_, {.accept_changed = true}));
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("run");
  const OdometryRun run_ = MakeRun();
  std::string window_before_;
  std::size_t verified_bytes_ = 0;
};

TEST_F(RunJournalTest, IsReadAsAPartialRunInWhichWhatIsFinalGoesBeforeWhatWasInTheWindow) {
  OdometryRun read = ReadRunFolder(folder_);
  EXPECT_FALSE(read.complete);
  EXPECT_THAT(read.partial_reason, HasSubstr("cut off after 40 poses"));
  EXPECT_FALSE(read.verdict.has_value());  // nobody could judge it
  OdometryRun whole = run_;
  whole.states.resize(40);
  ResolveMergedLines(&whole);
  EXPECT_EQ(read.line_merges, whole.line_merges);
  EXPECT_EQ(read.line_merges.at(700), 103);
  std::ranges::sort(read.lines, {}, &Line::id);
  std::ranges::sort(read.landmarks, {}, &Landmark::id);
  testing::ExpectSameRun(read, whole);
}

TEST_F(RunJournalTest, OfARunThatHasJustBegunNothingIsRead) {
  const RunJournal journal(temp_.Path("begun"), run_);
  EXPECT_TRUE(ReadRunFolder(temp_.Path("begun")).states.empty());
}

TEST_F(RunJournalTest, AWholeRunTakesItsPlace) {
  WriteRunFolder(folder_, run_);
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/journal"));
  EXPECT_EQ(ReadRunFolder(folder_).states.size(), run_.states.size());
}

TEST_F(RunJournalTest, DamagedRowsAndFiguresAreNamed) {
  const std::string whole = ReadFile(Path("finished.csv"));
  const auto message = [&] {
    return MessageOf<DataError>([&] { ReadRunFolder(folder_, {.accept_changed = true}); });
  };
  for (const auto& [row, what] :
       {std::pair("fly,1,2", "found 'fly'"), std::pair("imu,1,2", "found 2 columns, expected 7"),
        std::pair("imu,x,1,2,3,4,5,6", "stamp_ns: found 'x'"),
        std::pair("observation,77,1,2,3,nan,nan", "keyframe_id: found '77'"),
        std::pair("landmark,5,0,3,1e30,0,0,0.1",
                  "x_m: found '1e30', expected -1000000 to 1000000")}) {
    WriteFile(Path("finished.csv"), std::string(row) + "\n" + whole);
    EXPECT_THAT(message(), AllOf(HasSubstr("journal/finished.csv: row 1: "), HasSubstr(what)));
  }
  WriteFile(Path("finished.csv"), whole);
  WriteFile(Path("state.json"),
            R"({"warnings": {}, "figures": {"points_rejected": {"mean": -1}}})");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }),
              HasSubstr("state.json: figures: points_rejected: mean: found -1"));
}

TEST_F(RunJournalTest, CountsWhatIsNotFinite) {
  RunJournal journal(temp_.Path("other"), run_);
  OdometryRun finished = FinishedPart(run_, 0, 2), window = WindowOf(run_, 2);
  finished.states[3].velocity_world_m_s.x() = std::nan("");
  window.landmarks[7].sigma_m = -1;
  journal.Append(finished);
  for (int i = 0; i < 2; ++i) journal.SetWindow(window);  // what is appended counts once
  const OdometryRun read = ReadRunFolder(temp_.Path("other"));
  EXPECT_EQ(read.states.size(), 19u);
  EXPECT_EQ(read.warnings.at("states_not_finite"), 1);
  EXPECT_EQ(read.warnings.at("landmarks_not_finite"), 1);
  EXPECT_EQ(read.warnings.at("images_missing"), 5);
}

TEST_F(RunJournalTest, RowsThatAreMissingInTheMiddleAreNoticed) {
  const std::string whole = ReadFile(Path("finished.csv"));
  for (const auto& [row, from, to] :
       {std::tuple("observation,", 17, 40), std::tuple("state,", 1, 29)}) {
    WriteFile(Path("finished.csv"), whole);
    RemoveRows("finished.csv", row, from, to);
    ExpectRefused("finished.csv: found ", "state.json");
  }
}

TEST_F(RunJournalTest, ACutBeforeWhatWasThereIsNoticed) {
  const std::string finished = ReadFile(Path("finished.csv")),
                    images = ReadFile(Path("images.csv"));
  WriteFile(Path("finished.csv"),
            finished.substr(0, finished.rfind('\n', verified_bytes_ - 2) + 1));
  ExpectRefused("finished.csv: found ", "state.json");
  WriteFile(Path("finished.csv"), finished);
  WriteFile(Path("images.csv"), images.substr(0, images.find('\n', images.find('\n') + 1) + 1));
  ExpectRefused("images.csv: found ", "header.json");
}

TEST_F(RunJournalTest, AnEmptyWindowIsNoticed) {
  WriteFile(Path("window.csv"), "");
  ExpectRefused("window.csv: found 0 rows of checksum ", "state.json");
  std::filesystem::remove(Path("window.csv"));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }), HasSubstr("window.csv: "));
}

// The window before was one of no rows, which is no empty file.
TEST_F(RunJournalTest, AnEmptyFirstWindowIsNoticed) {
  const std::string folder = temp_.Path("other");
  RunJournal(folder, run_).SetWindow(WindowOf(run_, 2));
  WriteFile(folder + "/journal/window.csv", "");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder); }),
              HasSubstr("window.csv: found 0 rows of checksum "));
}

TEST_F(RunJournalTest, ChangedValuesAreNoticed) {
  std::string text = ReadFile(Path("state.json"));
  const std::size_t at = text.find("0.0033");
  ASSERT_NE(at, text.npos);
  WriteFile(Path("state.json"), text.replace(at, 6, "0.0099"));
  ExpectRefused("state.json: found checksum ", "expected ");
}

TEST_F(RunJournalTest, AJournalWithoutItsStateIsTakenWhereChangesAre) {
  for (const bool is_there : {true, false}) {
    if (is_there) WriteFile(Path("state.json"), "{\"warnings\"");
    if (!is_there) std::filesystem::remove(Path("state.json"));
    EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }), HasSubstr("state.json: "));
    const OdometryRun read = ReadRunFolder(folder_, {.accept_changed = true});
    EXPECT_EQ(read.warnings.at("journal_state_unreadable"), 1);
    EXPECT_EQ(read.states.size(), 40u);
  }
}

// What was appended since may be missing from where the process ended.
TEST_F(RunJournalTest, CanBeCutAnywhereBehindWhatWasThere) {
  const std::string text = ReadFile(Path("finished.csv"));
  ASSERT_GT(text.size(), verified_bytes_);
  for (std::size_t size = verified_bytes_; size <= text.size(); size += 997) {
    WriteFile(Path("finished.csv"), text.substr(0, size));
    const OdometryRun read = ReadRunFolder(folder_);
    EXPECT_GE(read.states.size(), 30u);
    EXPECT_EQ(read.keyframes.size(), 6u) << "those that are missing are in the window";
    const bool torn = text[size - 1] != '\n';
    EXPECT_EQ(read.warnings.count("rows of the journal that were cut off"), torn ? 1u : 0u);
  }
}

// state.json is there before the window that it tells of.
TEST_F(RunJournalTest, IsReadableBetweenItsTwoWrites) {
  std::filesystem::rename(Path("window.csv"), Path("window.csv.new"));
  WriteFile(Path("window.csv"), window_before_);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.keyframes.size(), 6u);
  EXPECT_EQ(read.line_deviation_rad, 0.0033);
}

TEST_F(RunJournalTest, AnOlderWindowIsNotTheOneThatWasThere) {
  RunJournal journal(temp_.Path("other"), run_);
  for (const std::size_t from : {1, 2, 3}) journal.SetWindow(WindowOf(run_, from));
  const OdometryRun read = ReadRunFolder(temp_.Path("other"));
  EXPECT_EQ(read.keyframes.size(), 3u);
  EXPECT_EQ(read.calibration.size(), 2u) << "though nothing has left the window";
  RunJournal(temp_.Path("first"), run_).SetWindow(WindowOf(run_, 1));
  std::filesystem::copy_file(temp_.Path("first/journal/window.csv"),
                             temp_.Path("other/journal/window.csv"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(temp_.Path("other")); }),
              HasSubstr("window.csv: found "));
}

}  // namespace
}  // namespace slcmap
