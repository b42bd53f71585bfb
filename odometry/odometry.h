// Stereo visual-inertial odometry, usable without any file:
//
//   Odometry odometry(rig, options);
//   odometry.AddImu(sample);                       // in the order of their stamps
//   for (const OnlineState& s : odometry.AddStereo(image)) ...
//   ...
//   for (const OnlineState& s : odometry.Finish()) ...  // with several threads
//   const OdometryRun run = odometry.Run();
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "odometry/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

class Odometry {
 public:
  // Throws ConfigError or DataError when options or rig are not plausible.
  //
  // With one thread, everything is done one after the other within AddStereo(). With more (two are
  // used), points and lines are tracked side by side, and a keyframe's window is optimised while
  // the next image is tracked: the same states, of keyframes one call later.
  Odometry(const Rig& rig, const OdometryOptions& options, int threads = 1);
  ~Odometry();

  // Takes one IMU sample. Unsorted, repeated and non-finite samples are counted and dropped.
  void AddImu(const ImuSample& sample);

  // Takes one stereo pair, or the images of all cameras, and processes every pair whose IMU samples
  // have arrived (this one waits otherwise). Returns a state for each pair processed once the
  // estimator is initialised; with several threads, that of a keyframe is returned by the next
  // call. Unsorted pairs, wrong sizes and empty left images are counted and dropped. Throws what a
  // thread threw.
  //
  // Right images are looked at on keyframes only. To save the decoding of the others, leave all but
  // the left image empty and let `decode` give them: in this or a later call, perhaps in another
  // thread, so it has to own what it needs.
  std::vector<OnlineState> AddStereo(const StereoImage& image, DeferredImages decode = {});

  // For how many seconds after an image IMU samples have to be there before it is processed: 0
  // where all rows of a pair are exposed at its stamp.
  double ImuAhead_s() const;

  // Waits for what is under way, and returns the states that AddStereo() has not returned yet. At
  // the end of the images, or where there is time until the next one.
  std::vector<OnlineState> Finish();

  // What was estimated so far: keyframes, landmarks, states, warnings; valid at any time, and waits
  // for what is under way. What is not finite is left out and counted. Timings hold the stages'
  // share; the whole process is the caller's to measure.
  OdometryRun Run();

  // What has become final since the last call: states, IMU samples, and the keyframes, landmarks
  // and lines that have left the window. Waits for nothing.
  OdometryRun TakeFinished();

  // What is in the window, and may still change: keyframes, landmarks, lines, and all Manhattan
  // worlds, which lines refer to; with it what the run knows of itself: figures, warnings, line
  // deviation. Waits for what is under way.
  OdometryRun Window();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

class RunJournal;

// Writes the run of an odometry into a folder as it goes: a program that is killed leaves it there.
class RunRecorder {
 public:
  // `header` is what is known of the run; odometry must outlive the recorder. `source_warnings`
  // tells what the reader of the recording has counted so far. Throws OutputError.
  RunRecorder(const std::string& run_folder, const OdometryRun& header, Odometry* odometry,
              std::function<Warnings()> source_warnings);
  ~RunRecorder();

  // Writes what has become final; from time to time, also what is in the window. To be called after
  // each image. Throws OutputError.
  void Update();

 private:
  void UpdateWindow(OdometryRun finished);

  Odometry* odometry_;
  const std::function<Warnings()> source_warnings_;
  std::unique_ptr<RunJournal> journal_;
  std::chrono::steady_clock::time_point window_written_;
  int worlds_ = 0, slopes_ = 0;  // Manhattan worlds and slopes that the journal knows
};

}  // namespace slcmap::odometry
