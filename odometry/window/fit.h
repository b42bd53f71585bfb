// How well measurements fit the states that were estimated from them.
#pragma once

#include "odometry/window/problem_builder.h"
#include "odometry/window/window_state.h"

namespace slcmap {

// Of the IMU's measurement between two states.
struct ImuFit {
  double chi2 = 0;               // squared residual of a row, by its variance: 1 as claimed
  double turn_rate_rad_s = 0;    // residual of the turn over the time between
  double acceleration_m_s2 = 0;  // the same of the velocity
};

// `to.from_previous` leads from one to the other.
ImuFit MeasureImuFit(const CostModel& model, const FrameState& from, const FrameState& to);

// Of observations of points whose place is known, each by one camera.
struct PointFit {
  int observations = 0;
  int rejected = 0;  // of them
  double chi2 = 0;   // squared residuals by their variances, sum over those that are kept

  void Add(double observation_chi2, double max_chi2) {
    ++observations;
    rejected += observation_chi2 > max_chi2;
    chi2 += observation_chi2 > max_chi2 ? 0 : observation_chi2;
  }
};

// Of an image that was estimated alone against the window.
struct FrameFit {
  ImuFit imu;      // from the newest keyframe
  int points = 0;  // that it shows and the window knows
  int rejected = 0;
};

// Of a window that was optimised with a new keyframe.
struct WindowFit {
  double imu_chi2 = 0;  // mean over the intervals between its keyframes
  PointFit points;
  int newest_points = 0, newest_right = 0;  // that the new keyframe shows, in its right image too
};

// All but the points, which are judged where they are rejected.
WindowFit MeasureWindowFit(const CostModel& model, const WindowState& window);

}  // namespace slcmap
