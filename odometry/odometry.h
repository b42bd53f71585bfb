// Stereo visual-inertial odometry, usable without any file:
//
//   Odometry odometry(rig, options);
//   odometry.AddImu(sample);                       // in the order of their stamps
//   for (const OnlineState& s : odometry.AddStereo(image)) ...
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "data/types.h"
#include "odometry/options.h"
#include "odometry/run.h"

namespace slcmap {

class Odometry {
 public:
  // Throws ConfigError or DataError when options or rig are not plausible.
  Odometry(const Rig& rig, const OdometryOptions& options);
  ~Odometry();

  // Takes one IMU sample. Unsorted, repeated and non-finite samples are counted and dropped.
  void AddImu(const ImuSample& sample);

  // Takes one stereo pair and processes every pair whose IMU samples have arrived (this one waits
  // otherwise). Returns a state for each pair processed once the estimator is initialised. Unsorted
  // pairs, wrong sizes and empty left images are counted and dropped.
  //
  // The right image is looked at on keyframes only. To save the decoding of the others, leave it
  // empty and let decode_right give it.
  std::vector<OnlineState> AddStereo(const StereoImage& image,
                                     std::function<cv::Mat()> decode_right = nullptr);

  // What was estimated so far: keyframes, landmarks, states, warnings; valid at any time. What is
  // not finite is left out and counted. Timings hold the stages' share; the whole process is the
  // caller's to measure.
  OdometryRun Run() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap
