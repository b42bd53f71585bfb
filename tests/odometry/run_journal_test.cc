#include "odometry/run/run_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/run_queries.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;

// What is known of a run before it begins.
OdometryRun HeaderOf(const OdometryRun& run) {
  OdometryRun header;
  header.method = run.method;
  header.rectified_rig = run.rectified_rig;
  return header;
}

// The part of a run from keyframe `from` up to `to`, with all landmarks and lines if it is the
// last.
OdometryRun Part(const OdometryRun& run, std::size_t from, std::size_t to) {
  OdometryRun part;
  part.keyframes = {run.keyframes.begin() + from, run.keyframes.begin() + to};
  const int64_t first_ns = part.keyframes.front().stamp_ns,
                last_ns = part.keyframes.back().stamp_ns;
  for (const OnlineState& state : run.states) {
    if (state.stamp_ns >= first_ns && state.stamp_ns <= last_ns) part.states.push_back(state);
  }
  return part;
}

class RunJournalTest : public ::testing::Test {
 protected:
  RunJournalTest() {
    RunJournal journal(folder_, HeaderOf(run_));
    OdometryRun finished = Part(run_, 0, 3), window = Part(run_, 2, 6);
    finished.landmarks = {run_.landmarks[0], run_.landmarks[1]};
    finished.lines = {run_.lines[23]};
    finished.imu = {{1, {1, 2, 3}, {4, 5, 6}}};
    window.states.clear();
    window.landmarks = run_.landmarks;
    window.landmarks[1].p_world.x() = 77;  // has changed before it left the window
    window.lines = {run_.lines[22]};
    window.manhattan_worlds = run_.manhattan_worlds;
    window.sloped_directions = {{0, 0.25, 0.5, 0.001, 0.002, 7, false}};
    window.lines[0].axis = LineAxis::kSloped;
    window.lines[0].world = 0;
    window.figures.points_rejected = {0.1, 0.2, 30};
    finished.calibration = {Calibration(2, 0.001), Calibration(4, 0.002)};
    window.calibration = {Calibration(4, 0.003), Calibration(5, 0.004)};
    journal.SetWindow(window);
    journal.Append(finished);
  }
  // As known at a keyframe.
  CalibrationEstimate Calibration(std::size_t keyframe, double time_offset_s) const {
    CalibrationEstimate estimate;
    estimate.stamp_ns = run_.keyframes[keyframe].stamp_ns;
    estimate.segment = run_.keyframes[keyframe].segment;
    estimate.time_offset_s = time_offset_s;
    return estimate;
  }
  std::string Path(const char* name) const { return folder_ + "/journal/" + name; }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("run");
  const OdometryRun run_ = testing::MakeLineRun();
};

TEST_F(RunJournalTest, IsReadAsAPartialRunThatSaysSo) {
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.method, "points");
  EXPECT_EQ(read.rectified_rig.cameras[0].fx_px, run_.rectified_rig.cameras[0].fx_px);
  EXPECT_FALSE(read.complete);
  EXPECT_THAT(read.partial_reason, HasSubstr("cut off after 21 poses"));
  ASSERT_EQ(read.states.size(), 21u);
  EXPECT_EQ(read.states[20].T_world_imu.translation, run_.states[20].T_world_imu.translation);
  EXPECT_EQ(read.imu.size(), 1u);
  EXPECT_EQ(read.figures.points_rejected.worst, 0.2);
  EXPECT_FALSE(read.verdict.has_value());  // nobody could judge it
}

TEST_F(RunJournalTest, DamagedFiguresAreNamed) {
  WriteFile(Path("state.json"),
            R"({"warnings": {}, "figures": {"points_rejected": {"mean": -1}}})");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }),
              HasSubstr("state.json: figures: points_rejected: mean: found -1"));
}

TEST_F(RunJournalTest, WhatIsFinalGoesBeforeWhatWasInTheWindow) {
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.keyframes.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.keyframes[i].id, run_.keyframes[i].id);
    EXPECT_EQ(read.keyframes[i].observations.size(), run_.keyframes[i].observations.size());
    EXPECT_EQ(read.keyframes[i].lines.size(), run_.keyframes[i].lines.size());
  }
  ASSERT_EQ(read.landmarks.size(), 400u);
  EXPECT_EQ(read.landmarks[1].p_world, run_.landmarks[1].p_world);
  ASSERT_EQ(read.lines.size(), 2u);
  EXPECT_EQ(read.lines[0].world, 0);
  EXPECT_EQ(read.manhattan_worlds.size(), 1u);
  EXPECT_EQ(read.lines[1].axis, LineAxis::kSloped);
  ASSERT_EQ(read.sloped_directions.size(), 1u);
  EXPECT_EQ(read.sloped_directions[0].azimuth_rad, 0.25);
  EXPECT_EQ(read.sloped_directions[0].found_at_ns, 7);
}

TEST_F(RunJournalTest, TheCalibrationIsThatOfTheWindowInTheEnd) {
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.calibration.size(), 3u);
  EXPECT_EQ(read.calibration[1].time_offset_s, 0.002);
  EXPECT_EQ(read.calibration[2].time_offset_s, 0.004);
  WriteFile(Path("finished.csv"), "");  // a short run: nothing has left the window
  EXPECT_EQ(ReadRunFolder(folder_).calibration.size(), 2u);
}

TEST_F(RunJournalTest, CanBeCutAnywhere) {
  const std::string whole = ReadFile(Path("finished.csv"));
  for (std::size_t size = 0; size < whole.size(); size += whole.size() / 50) {
    WriteFile(Path("finished.csv"), whole.substr(0, size));
    const OdometryRun read = ReadRunFolder(folder_);
    EXPECT_LE(read.states.size(), 21u);
    const bool torn = size > 0 && whole[size - 1] != '\n';
    EXPECT_EQ(read.warnings.count("rows of the journal that were cut off"), torn ? 1u : 0u);
  }
}

TEST_F(RunJournalTest, OfARunThatHasJustBegunNothingIsRead) {
  const std::string folder = temp_.Path("begun");
  const RunJournal journal(folder, HeaderOf(run_));
  EXPECT_TRUE(ReadRunFolder(folder).states.empty());
}

TEST_F(RunJournalTest, DamagedRowsAreNamed) {
  const std::string whole = ReadFile(Path("finished.csv"));
  const auto expect = [&](const std::string& row, const char* what) {
    WriteFile(Path("finished.csv"), row + "\n" + whole);
    const std::string message = MessageOf<DataError>([&] { ReadRunFolder(folder_); });
    EXPECT_THAT(message, HasSubstr("journal/finished.csv: row 1: "));
    EXPECT_THAT(message, HasSubstr(what));
  };
  expect("fly,1,2", "found 'fly'");
  expect("imu,1,2", "found 2 columns, expected 7");
  expect("imu,x,1,2,3,4,5,6", "stamp_ns: found 'x'");
  expect("observation,77,1,2,3,nan,nan", "keyframe_id: found '77'");
  expect("landmark,5,0,3,1e30,0,0,0.1", "x_m: found '1e30', expected -1000000 to 1000000");
}

TEST_F(RunJournalTest, AWholeRunTakesItsPlace) {
  OdometryRun whole = run_;
  WriteRunFolder(folder_, whole);
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/journal"));
  EXPECT_TRUE(ReadRunFolder(folder_).complete);
}

// What becomes of a journal that was damaged, and of one whose process ended in between.

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
  return part;
}

OdometryRun WindowOf(const OdometryRun& run, std::size_t from) {
  OdometryRun window = run;
  window.states.clear();
  window.imu.clear();
  window.keyframes.erase(window.keyframes.begin(), window.keyframes.begin() + from);
  return window;
}

class RunJournalDamageTest : public ::testing::Test {
 protected:
  RunJournalDamageTest() {
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

TEST_F(RunJournalDamageTest, HoldsWhatTheRunKnowsOfItself) {
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.method, run_.method);
  EXPECT_EQ(read.warnings, run_.warnings);
  EXPECT_EQ(read.line_deviation_rad, run_.line_deviation_rad);
  EXPECT_EQ(read.figures.points_rejected.mean, 0.1);
  EXPECT_EQ(read.figures.points_rejected.count, 30);
  ASSERT_EQ(read.calibration.size(), 2u);
  EXPECT_EQ(read.calibration[1].time_offset_s, 0.004);
  EXPECT_EQ(read.states.size(), 40u);
  EXPECT_EQ(read.landmarks.size(), run_.landmarks.size());
  EXPECT_EQ(read.lines.size(), run_.lines.size());
  ASSERT_TRUE(read.source.has_value());
  EXPECT_EQ(read.source->images.size(), 6u);
  EXPECT_EQ(read.source->options, run_.source->options);
  EXPECT_EQ(read.source->check_errors, run_.source->check_errors);
  ASSERT_EQ(read.source->corrections.size(), 1u);
  EXPECT_EQ(read.source->corrections[0].values, run_.source->corrections[0].values);
}

TEST_F(RunJournalDamageTest, HoldsWhichLinesWereMerged) {
  const OdometryRun read = ReadRunFolder(folder_);
  OdometryRun whole = run_;
  ResolveMergedLines(&whole);
  EXPECT_EQ(whole.line_merges.at(700), 103);
  EXPECT_EQ(read.line_merges, whole.line_merges);
  ASSERT_EQ(read.keyframes.size(), whole.keyframes.size());
  for (std::size_t i = 0; i < whole.keyframes.size(); ++i) {
    ASSERT_EQ(read.keyframes[i].lines.size(), whole.keyframes[i].lines.size());
    for (std::size_t k = 0; k < whole.keyframes[i].lines.size(); ++k) {
      EXPECT_EQ(read.keyframes[i].lines[k].id, whole.keyframes[i].lines[k].id);
    }
  }
}

TEST_F(RunJournalDamageTest, CountsWhatIsNotFinite) {
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

TEST_F(RunJournalDamageTest, RowsThatAreMissingInTheMiddleAreNoticed) {
  const std::string whole = ReadFile(Path("finished.csv"));
  for (const auto& [row, from, to] :
       {std::tuple("observation,", 17, 40), std::tuple("state,", 1, 29)}) {
    WriteFile(Path("finished.csv"), whole);
    RemoveRows("finished.csv", row, from, to);
    ExpectRefused("finished.csv: found ", "state.json");
  }
}

TEST_F(RunJournalDamageTest, ACutBeforeWhatWasThereIsNoticed) {
  const std::string finished = ReadFile(Path("finished.csv")),
                    images = ReadFile(Path("images.csv"));
  WriteFile(Path("finished.csv"),
            finished.substr(0, finished.rfind('\n', verified_bytes_ - 2) + 1));
  ExpectRefused("finished.csv: found ", "state.json");
  WriteFile(Path("finished.csv"), finished);
  WriteFile(Path("images.csv"), images.substr(0, images.find('\n', images.find('\n') + 1) + 1));
  ExpectRefused("images.csv: found ", "header.json");
}

TEST_F(RunJournalDamageTest, AnEmptyWindowIsNoticed) {
  WriteFile(Path("window.csv"), "");
  ExpectRefused("window.csv: found 0 rows of checksum ", "state.json");
  std::filesystem::remove(Path("window.csv"));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder_); }), HasSubstr("window.csv: "));
}

// The window before was one of no rows, which is no empty file.
TEST_F(RunJournalDamageTest, AnEmptyFirstWindowIsNoticed) {
  const std::string folder = temp_.Path("other");
  RunJournal(folder, run_).SetWindow(WindowOf(run_, 2));
  WriteFile(folder + "/journal/window.csv", "");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(folder); }),
              HasSubstr("window.csv: found 0 rows of checksum "));
}

TEST_F(RunJournalDamageTest, ChangedValuesAreNoticed) {
  std::string text = ReadFile(Path("state.json"));
  const std::size_t at = text.find("0.0033");
  ASSERT_NE(at, text.npos);
  WriteFile(Path("state.json"), text.replace(at, 6, "0.0099"));
  ExpectRefused("state.json: found checksum ", "expected ");
}

TEST_F(RunJournalDamageTest, AJournalWithoutItsStateIsTakenWhereChangesAre) {
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
TEST_F(RunJournalDamageTest, CanBeCutAnywhereBehindWhatWasThere) {
  const std::string text = ReadFile(Path("finished.csv"));
  ASSERT_GT(text.size(), verified_bytes_);
  for (std::size_t size = verified_bytes_; size <= text.size(); size += 97) {
    WriteFile(Path("finished.csv"), text.substr(0, size));
    const OdometryRun read = ReadRunFolder(folder_);
    EXPECT_GE(read.states.size(), 30u);
    EXPECT_EQ(read.keyframes.size(), 6u) << "those that are missing are in the window";
  }
}

// state.json is there before the window that it tells of.
TEST_F(RunJournalDamageTest, IsReadableBetweenItsTwoWrites) {
  std::filesystem::rename(Path("window.csv"), Path("window.csv.new"));
  WriteFile(Path("window.csv"), window_before_);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.keyframes.size(), 6u);
  EXPECT_EQ(read.line_deviation_rad, 0.0033);
}

TEST_F(RunJournalDamageTest, AnOlderWindowIsNotTheOneThatWasThere) {
  RunJournal journal(temp_.Path("other"), run_);
  for (const std::size_t from : {1, 2, 3}) journal.SetWindow(WindowOf(run_, from));
  const OdometryRun read = ReadRunFolder(temp_.Path("other"));
  EXPECT_EQ(read.keyframes.size(), 3u);
  RunJournal(temp_.Path("first"), run_).SetWindow(WindowOf(run_, 1));
  std::filesystem::copy_file(temp_.Path("first/journal/window.csv"),
                             temp_.Path("other/journal/window.csv"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(MessageOf<DataError>([&] { ReadRunFolder(temp_.Path("other")); }),
              HasSubstr("window.csv: found "));
}

}  // namespace
}  // namespace slcmap
