// A run that is written as it goes, the files that say where it came from (raw_rig.json,
// options.yaml, images.csv), and what readers do with files that were changed.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// Calls read(), which fills what a run can do without. Where changes are accepted, what it refuses
// by a DataError is left out, which is said, and counted among the run's warnings.
template <typename Read>
void ReadOrLeaveOut(bool accept_changed, const char* warning, OdometryRun* run, Read read) {
  try {
    read();
  } catch (const DataError& error) {
    if (!accept_changed) throw;
    ++run->warnings[warning];
    spdlog::warn("{}; left out", error.what());
  }
}

// Their names.
std::vector<std::string> RunSourceFiles();

// Throws OutputError.
void WriteRunSource(const std::string& folder, const RunSource& source);

// Fills what the files hold. Throws DataError.
void ReadRunSource(const std::string& folder, RunSource* source);

// A run that is written as it goes, so that a program that is killed loses a second of it at most.
//
// The folder "journal" in the run folder holds header.json (method, source, and the list of files
// that are written with it), finished.csv, which grows by what has left the window, and window.csv,
// which is replaced by what is in the window. Their rows are those of RunColumns(), after the name
// of their table. state.json, which is replaced with it, holds what the run knows about itself, and
// what the rows are that were written until then. finished.csv is written first, then state.json,
// then window.csv: whenever the process is killed, what state.json says of them holds.

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

  // Replaces what is in the window, and with it figures, warnings and line deviation. Throws
  // OutputError.
  void SetWindow(const OdometryRun& window);

 private:
  struct Written;
  void Write(const std::string& rows);
  void SyncNowAndThen();

  std::string folder_;
  int file_ = -1;
  std::unique_ptr<Written> written_;
  std::map<std::string, int64_t> left_out_;  // of what was appended, counted by kind
  std::future<void> sync_;
  int64_t synced_at_ns_ = 0;
};

// Whether a run folder holds a journal.
bool HasRunJournal(const std::string& run_folder);

// The run up to where the journal ends, as a partial one that says so. A last row that was cut off
// is left out and counted. Throws DataError, naming file and row, also where files are not as they
// were written, unless those are accepted.
OdometryRun ReadRunJournal(const std::string& run_folder, bool accept_changed = false);

}  // namespace slcmap::odometry
