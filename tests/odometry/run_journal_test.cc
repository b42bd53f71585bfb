#include "odometry/run/run_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/core/error.h"
#include "data/io/file.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

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

}  // namespace
}  // namespace slcmap
