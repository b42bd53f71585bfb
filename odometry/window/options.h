// The options of the estimator: its window, keyframes, landmarks and start.
#pragma once

#include "data/io/yaml.h"
#include "odometry/factors/options.h"
#include "odometry/frontend/options.h"
#include "odometry/run/run.h"
#include "odometry/structure/options.h"

namespace slcmap::inline odometry {

inline constexpr double kStartWindow_s = 0.6;  // of data that initialisation in motion looks at
// At rest: deviation of the accelerometer
inline constexpr double kStartMaxStillAccelSigma_m_s2 = 0.3;
inline constexpr double kStartMaxStillGyroSigma_rad_s = 0.05;
inline constexpr int kLandmarkMinGeneralKeyframes = 4;  // that saw a line of no axis

// When the place of a point is known; see odometry/window/point_landmarks.h.
struct PointTriangulationOptions {
  double max_residual_sigma = 4;  // RMS of the reprojections, in standard deviations
  double min_depth_m = 0.1;
  double max_depth_m = 300;
};

struct WindowOptions {
  int max_keyframes = 10;
  // Of a measured coordinate: points that stay in place scatter by 0.2 to 0.25 px, and a third of
  // all that is measured is off by more, as things behind each other seem to slide.
  double point_sigma_px = 0.25;
  double max_tracking_chi2 = 50.0;  // the same between keyframes, where points are held fixed
  int max_iterations = 6;           // of a keyframe's optimisation
  double zero_velocity_sigma_m_s = 0.02;
  PointTriangulationOptions triangulation;
  void Check() const;
  void Read(YamlSection section);
};

struct KeyframeOptions {
  double min_parallax_px = 24;   // median, since the last keyframe, without the rotation
  double min_kept_share = 0.65;  // of the last keyframe's points that are still tracked
  double max_interval_s = 1.0;   // while the rig moves
  void Check() const;
  void Read(YamlSection section);
};

struct InitializerOptions {
  int min_points = 20;                  // seen in the window's first and last image
  double max_reprojection_sigma = 3.2;  // RMS after optimisation, in standard deviations
};

struct FailureOptions {
  int min_points = 6;       // tracked; fewer are "lost"
  double max_lost_s = 2.0;  // without images, or thrice as long without points: a new segment
  double max_speed_m_s = 15;
  void Check() const;
  void Read(YamlSection section);
};

// When the place of a line is known; see odometry/window/line_triangulation.h.
struct LineTriangulationOptions {
  double min_distance_m = 0.1;  // from the anchor
  double max_distance_m = 100;
  double loss_sigma = 2;  // where the Huber loss of an observation turns linear
};

// Lines as landmarks of the window.
struct LineLandmarkOptions {
  double sigma_px = 0.2;    // of a segment's end, across the estimated line
  double loss_sigma = 1.5;  // where the robust loss turns
  double max_chi2 = 16.0;   // of one camera's observation (2 rows) that is kept
  // The same, of the left observations of a line in the window. Observations scatter by a third of
  // sigma_px: with a sigma as small as the scatter, a limit so low retires nearly all lines.
  double max_median_chi2 = 2.0;
  double max_new_chi2 = 56.0;        // of an observation, when its line is first estimated
  double max_tracking_chi2 = 900.0;  // of an observation in a keyframe that is not optimised yet
  bool anchor_at_origin = false;     // as in the paper; else where the line was first seen from
  // Two lines of one axis are one where their distance is within so many standard deviations of
  // their places against each other, or below a least distance (conditional covariances make little
  // of what the lines share with the poses), and never above the largest: jambs of doors are 5 to
  // 8 cm wide.
  double point_sigma_m = 0.01;  // of a point's distance from the line it belongs to
  // How well a point and its line have to be known against each other, until it counts that they
  // agree.
  double max_member_sigma_m = 0.015;
  LineTriangulationOptions triangulation;
  void Check() const;
  void Read(YamlSection section);
};

// All that the estimator can be configured with.
struct EstimatorOptions {
  Method method = Method::kSlc;
  PointTrackerOptions points;
  WindowOptions window;
  KeyframeOptions keyframes;
  InitializerOptions initializer;
  CalibrationOptions calibration;
  FailureOptions failure;
  ManhattanOptions manhattan;
  SlopeOptions slopes;
  LineLandmarkOptions line_landmarks;
  BuildingDeviationOptions building_deviation;
};

}  // namespace slcmap::odometry
