// What `slcmap odometry` keeps while it is at work: the journal of a run and its stream of poses.
// Its options stand in options.h, the stage in odometry_stage.h.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "data/core/error.h"
#include "data/io/trajectory.h"
#include "odometry/odometry.h"
#include "odometry/run/run_journal.h"

namespace slcmap::inline commands {

class RunRecorder {
 public:
  // `header` is what is known of the run; odometry must outlive the recorder. `source_warnings`
  // tells what the reader of the recording has counted so far. Throws OutputError.
  RunRecorder(const std::string& run_folder, const OdometryRun& header, Odometry* odometry,
              std::function<Warnings()> source_warnings);

  // Writes what has become final; from time to time, also what is in the window. To be called after
  // each image. Throws OutputError.
  void Update();

 private:
  void UpdateWindow(OdometryRun finished);

  Odometry* odometry_;
  const std::function<Warnings()> source_warnings_;
  RunJournal journal_;
  std::chrono::steady_clock::time_point window_written_;
  int worlds_ = 0, slopes_ = 0;  // Manhattan worlds and slopes that the journal knows
};

// A TUM file that grows row by row, so that an interrupted run leaves what it has.

class TrajectoryStream {
 public:
  // Opens the file anew. Throws OutputError.
  explicit TrajectoryStream(const std::string& path);

  // Adds a row, which is in the file when the call returns. Throws OutputError, as on a full disk.
  void Add(const StampedPose& pose);

 private:
  void Write(const std::string& text);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace slcmap::commands
