// The first states of a segment: at rest, or in motion.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "odometry/window/linear_alignment.h"
#include "odometry/window/options.h"
#include "odometry/window/sliding_window.h"

namespace slcmap::inline odometry {

// How an attempt went, with its numbers against their thresholds; `report` is one line for the log.
struct InitializationResult {
  bool success = false;
  bool at_rest = false;
  std::string report;
  FinishedIds finished;  // lines that turned out not to fit
};

class Initializer {
 public:
  Initializer(const InitializerOptions& options, const Rig& rectified_rig);

  // Takes the next frame with its measurements and the preintegration since the one before (none
  // for the first).
  void AddFrame(std::unique_ptr<FrameState> frame);

  // True once enough time has been gathered for an attempt.
  bool Ready() const;

  // Tries to start the window. On success the frames have moved there; otherwise the oldest are
  // forgotten, so that a later attempt looks at new data. The first frame's position and heading
  // become those of `start`, where one is given. The samples are cut anew from `imu` where the time
  // offset turns out to be another.
  InitializationResult Try(const std::optional<RigidTransform>& start, const ImuBuffer& imu,
                           SlidingWindow* window);

  // The stamp of the oldest sample that is needed; there must be a frame.
  int64_t first_cut_ns() const { return frames_.front()->cut_stamp_ns(); }

  void Reset() {
    frames_.clear();
    window_s_ = kStartWindow_s;
  }
  size_t size() const { return frames_.size(); }

 private:
  InitializationResult TryAtRest(const std::optional<RigidTransform>& start, SlidingWindow* window);
  InitializationResult TryInMotion(const std::optional<RigidTransform>& start, const ImuBuffer& imu,
                                   SlidingWindow* window);
  void CutAgain(const ImuBuffer& imu, int64_t offset_ns);
  std::vector<std::unique_ptr<FrameState>> EverySecond(const LinearAlignment& alignment,
                                                       const RigidTransform& T_world_first,
                                                       const RigidTransform& T_imu_body,
                                                       const Eigen::Vector3d& gyro_bias) const;
  void RemoveOldest();
  double Span_s() const;

  InitializerOptions options_;
  double window_s_;  // that the next attempt looks at
  Rig rig_;
  std::vector<std::unique_ptr<FrameState>> frames_;
};

// The median distance in pixels between what two frames saw of the same points, each in the camera
// that follows it, and how many those are. With R_b_a (by camera, b from a) the rotation is taken
// out first.
struct Flow {
  double median_px = 0;
  int points = 0;
};
Flow MedianFlow(const FrameState& a, const FrameState& b, double focal_px,
                const std::vector<Eigen::Quaterniond>& R_b_a = {});

}  // namespace slcmap::odometry
