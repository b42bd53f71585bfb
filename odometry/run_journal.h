// A run that is written as it goes, so that a program that is killed loses a second of it at most.
//
// The folder "journal" in the run folder holds header.json (method, source, rectified rig),
// finished.csv, which grows by what has left the window, and window.csv, which is replaced by what
// is in the window. Their rows are those of RunColumns(), after the name of their table.
// figures.json, which is replaced with it, holds what the run knows about itself.
#pragma once

#include <cstdint>
#include <future>
#include <string>

#include "odometry/run.h"

namespace slcmap {

inline constexpr const char* kJournalFolder = "journal";

class RunJournal {
 public:
  // Opens a journal in a run folder. Of `header` method, source and rectified rig are kept. Throws
  // OutputError.
  RunJournal(const std::string& run_folder, const OdometryRun& header);
  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  // Appends states, IMU samples, and the keyframes, landmarks and lines that are final. All of it
  // is in the file when the call returns, so that it survives the process. Throws OutputError.
  void Append(const OdometryRun& finished);

  // Replaces what is in the window, and the figures. Throws OutputError.
  void SetWindow(const OdometryRun& window);

 private:
  void SyncNowAndThen();

  std::string folder_;
  int file_ = -1;
  std::future<void> sync_;
  int64_t synced_at_ns_ = 0;
};

// Whether a run folder holds a journal.
bool HasRunJournal(const std::string& run_folder);

// The run up to where the journal ends, as a partial one that says so. A last row that was cut off
// is left out and counted. Throws DataError, naming file and row.
OdometryRun ReadRunJournal(const std::string& run_folder);

}  // namespace slcmap
