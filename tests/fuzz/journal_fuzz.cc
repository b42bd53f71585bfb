// The journal of a run that was ended, one of whose files is another.
#include <spdlog/spdlog.h>

#include "odometry/run/run_folder.h"
#include "odometry/run/run_journal.h"
#include "tests/fuzz/folder_target.h"
#include "tests/testing/made_run.h"

namespace {

// Half of the run has left the window.
void WriteJournal(const std::string& folder) {
  slcmap::OdometryRun window = slcmap::testing::MakeLineRun(), finished;
  window.source = slcmap::testing::MakeSource(window);
  window.warnings = {{"images_missing", 5}};
  window.line_deviation_rad = 0.002;
  window.figures.points_rejected = {0.1, 0.2, 30};
  window.sloped_directions = {{0, 0.25, 0.5, 0.001, 0.002, 7, false}};
  window.line_merges = {{900, 103}};
  window.calibration.push_back({window.keyframes[4].stamp_ns, 0, 0.001});
  slcmap::RunJournal journal(folder, window);
  finished.states = std::move(window.states);
  finished.imu = {{1, {1, 2, 3}, {4, 5, 6}}, {2, {1, 2, 3}, {4, 5, 6}}};
  finished.keyframes = {window.keyframes[0], window.keyframes[1]};
  finished.landmarks = {window.landmarks[0]};
  finished.manhattan_worlds = window.manhattan_worlds;
  finished.lines = {window.lines[0], window.lines[22]};
  journal.Append(finished);
  journal.SetWindow(window);
}

const slcmap::fuzz::FolderTarget& Target() {
  static const slcmap::fuzz::FolderTarget target(WriteJournal);
  return target;
}

}  // namespace

std::vector<std::string> slcmap::fuzz::Seeds() {
  spdlog::set_level(spdlog::level::off);  // of what is left out where changes are accepted
  return Target().Seeds();
}

// As changes are accepted, too: otherwise the checksums refuse most of what is read.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  for (const bool accept : {false, true}) {
    Target().Run(bytes, size, [&](const std::string& folder) {
      slcmap::ReadRunFolder(folder, {.accept_changed = accept});
    });
  }
  return 0;
}
