// Views between keyframes, where those are far apart; whether the world of given poses has up where
// the accelerometer has it; and where given poses jump.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "data/core/types.h"
#include "data/io/trajectory.h"
#include "mapping/views/options.h"
#include "mapping/views/view.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The frames (their indices) that are keyframes, by segment and stamp, and those between two
// keyframes of a segment that are apart from the view before and from the next keyframe; without
// those that as many as max_alike before them, of their segment, are like. Frames and keyframes are
// sorted by stamp; keyframes that are no frames are left out.
std::vector<size_t> SelectViews(const Views& frames, const Views& keyframes,
                                const ViewSpacingOptions& options);

// Some of the views of other images.
class SelectedImages : public ViewImages {
 public:
  // `all` must outlive it.
  SelectedImages(const ViewImages& all, std::vector<size_t> selected)
      : all_(all), selected_(std::move(selected)) {}

  const Rig& rig() const override { return all_.rig(); }
  const cv::Mat& mask(int camera) const override { return all_.mask(camera); }
  int left_camera(size_t view) const override { return all_.left_camera(selected_[view]); }
  StereoImage Read(size_t view) const override { return all_.Read(selected_[view]); }

 private:
  const ViewImages& all_;
  const std::vector<size_t> selected_;
};

inline constexpr double kLeastForce_m_s2 = 8;  // of gravity's, else samples are no m/s^2

// The mean specific force at the poses, in their world, m/s^2: about (0, 0, 9.8) where they are
// those of the IMU and z is up. Images stamped t were taken at t + camera_time_offset_s of the
// IMU's clock. None where few poses have a sample within 20 ms, or
// samples are no m/s^2.
std::optional<Eigen::Vector3d> MeanForceAt(const std::vector<OnlineState>& states,
                                           const std::vector<ImuSample>& imu,
                                           double camera_time_offset_s);

// What is wrong with it, in words; empty where nothing is.
std::string WhatIsNotUp(const Eigen::Vector3d& mean_force_m_s2);

// Where poses that were given jump, as those of a tracker that was lost or of a loop that was
// closed.

// A step from one pose to the next that neither the motion before it nor the one after explains.
struct PoseJump {
  int64_t from_ns = 0, stamp_ns = 0;  // of the pose that it starts from, and leads to
  double moved_m = 0;                 // besides the motion, where that explains it best
  double turned_rad = 0;
};

// Only steps of at most half a second are told from motion.
std::vector<PoseJump> FindJumps(const Trajectory& trajectory);

}  // namespace slcmap::mapping
