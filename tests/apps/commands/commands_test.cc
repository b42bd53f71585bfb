#include "apps/commands/commands.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "apps/commands/odometry_stage.h"
#include "apps/commands/progress.h"

namespace slcmap::inline commands {}  // namespace slcmap::commands

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Standard error as a terminal or a pipe, and back at the end.
class StandardError {
 public:
  explicit StandardError(bool is_terminal) : before_(dup(STDERR_FILENO)) {
    int ends[2] = {-1, -1};
    const int failed =
        is_terminal ? openpty(&ends[0], &ends[1], nullptr, nullptr, nullptr) : pipe(ends);
    if (failed != 0) throw std::runtime_error("no pair of files");
    dup2(ends[1], STDERR_FILENO);
    close(ends[1]);
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    read_end_ = ends[0];
  }
  ~StandardError() {
    dup2(before_, STDERR_FILENO);
    close(before_);
    close(read_end_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;

  std::string Text() const {
    std::string text(4096, '\0');
    const ssize_t size = read(read_end_, text.data(), text.size());
    text.resize(size > 0 ? static_cast<size_t>(size) : 0);
    return text;
  }

 private:
  const int before_;
  int read_end_ = -1;
};

// Longer than what no bar is shown for.
void Wait() { std::this_thread::sleep_for(std::chrono::milliseconds(150)); }

TEST(ProgressBar, IsDrawnOnATerminalAndLeavesItsLine) {
  const StandardError terminal(true);
  {
    ProgressBar bar("walking", ProgressBar::Elsewhere::kSeldom);
    bar.Update(0.1);
    EXPECT_EQ(terminal.Text(), "");  // what ends at once shows nothing
    Wait();
    bar.Update(0.5, [](double elapsed_s) { return elapsed_s > 0.1 ? "on the way" : "at once"; });
    EXPECT_THAT(terminal.Text(), AllOf(HasSubstr("walking [=============="),
                                       HasSubstr("]  50 %  on the way"), Not(HasSubstr("\n"))));
    bar.Update(1);
    EXPECT_THAT(terminal.Text(), HasSubstr("============================] 100 %"));
  }
  EXPECT_THAT(terminal.Text(), HasSubstr("\n"));
}

TEST(ProgressBar, SaysNothingWithQuietWhateverTheLevelIsLater) {
  const StandardError terminal(true);
  const auto level = spdlog::get_level();
  spdlog::set_level(spdlog::level::warn);
  const Progress quiet = StageProgress("quiet");
  spdlog::set_level(level);
  const Progress shown = StageProgress("shown");
  spdlog::set_level(spdlog::level::err);  // as while `check` reads
  Wait();
  EXPECT_TRUE(quiet.Report(0.5));
  EXPECT_TRUE(shown.Report(0.5));
  spdlog::set_level(level);
  EXPECT_THAT(terminal.Text(), AllOf(HasSubstr("shown ["), Not(HasSubstr("quiet"))));
}

TEST(ProgressBar, ElsewhereStagesSayNothing) {
  const StandardError file(false);
  const Progress progress = StageProgress("stage");
  Wait();
  EXPECT_TRUE(progress.Report(0.5));
  EXPECT_EQ(file.Text(), "");
}

CheckReport FoundAll() {
  CheckReport report;
  report.corrections = {{kTimeOffsetCorrection, {-0.02}, "time offset -20 ms"},
                        {kRightTurnCorrection, {0, 0.003, 0}, "right camera's turn"},
                        {kFocalCorrection, {-0.002, 0.004}, "focal lengths"}};
  return report;
}

TEST(StartCheck, WhatOptionsHoldStaysAsItWasCalibrated) {
  CheckReport report = FoundAll();
  CalibrationOptions held;
  const auto left = [&] {
    LeaveOutHeld(held, &report);
    std::vector<std::string> names;
    for (const CheckCorrection& correction : report.corrections) names.push_back(correction.name);
    return names;
  };
  EXPECT_EQ(left().size(), 3u);
  held.time_offset = false;
  EXPECT_THAT(left(), ElementsAre(kRightTurnCorrection, kFocalCorrection));
  held.right_rotation = false;
  EXPECT_THAT(left(), ElementsAre(kFocalCorrection));
  held.focal_length = false;
  EXPECT_TRUE(left().empty());
}

TEST(StartCheck, CorrectsFocalLengths) {
  Rig rig;
  rig.cameras[0].fx_px = rig.cameras[0].fy_px = rig.cameras[1].fx_px = rig.cameras[1].fy_px = 400;
  const Rig corrected = Corrected(rig, FoundAll());
  EXPECT_NEAR(corrected.cameras[1].fx_px, 401.6, 1e-9);
  EXPECT_NEAR(corrected.cameras[1].fy_px, 401.6, 1e-9);
  EXPECT_NEAR(corrected.cameras[0].fx_px, 399.2, 1e-9);
}

}  // namespace
}  // namespace slcmap
