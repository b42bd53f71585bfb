// The options of every module of odometry: defaults here, overridden by YAML, checked when built.
#pragma once

#include <string>

#include "data/yaml_options.h"
#include "odometry/method.h"

namespace slcmap {

struct RectifierOptions {
  double max_field_of_view_rad = 2.1;  // of the rectified image's width; matters for fisheye only
  double scale = 0.8;  // of the rectified focal length to that of the image's centre
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

struct PointTrackerOptions {
  int max_points = 160;
  double min_distance_px = 16;
  int pyramid_levels = 4;
  int patch_px = 13;
  double min_correlation = 0.8;    // normalised, with the image where the point was detected
  double max_epipolar_px = 1.5;    // left to right, across the rectified row
  double min_corner_gradient = 1;  // grey values a pixel, across the direction of least texture
  void Check() const;
  void Read(YamlSection section);
};

// When the place of a point is known; see window/triangulation.h.
struct PointTriangulationOptions {
  double min_parallax_rad = 0.01;  // between the host's ray and some other one
  double max_residual_sigma = 4;   // RMS of the reprojections, in standard deviations
  double min_depth_m = 0.1;
  double max_depth_m = 300;
  void Check() const;
  void Read(YamlSection section);
};

struct WindowOptions {
  int max_keyframes = 10;
  // Of a measured coordinate: points that stay in place scatter by 0.2 to 0.25 px, and a third of
  // all that is measured is off by more, as things behind each other seem to slide.
  double point_sigma_px = 0.25;
  double point_loss_sigma = 1.0;    // where the Huber loss turns linear
  double max_point_chi2 = 12.0;     // of one camera's measurement (2 rows) that is kept
  double max_tracking_chi2 = 50.0;  // the same between keyframes, where points are held fixed
  int max_iterations = 6;           // of a keyframe's optimisation
  int max_tracking_iterations = 4;  // of a frame between keyframes
  double zero_velocity_sigma_m_s = 0.02;
  // First prior of a segment.
  double first_tilt_sigma_rad = 0.2;
  double first_velocity_sigma_m_s = 2.0;
  double first_gyro_bias_sigma_rad_s = 0.1;
  double first_accel_bias_sigma_m_s2 = 0.2;
  PointTriangulationOptions triangulation;
  void Check() const;
  void Read(YamlSection section);
};

struct KeyframeOptions {
  double min_parallax_px = 24;   // median, since the last keyframe, without the rotation
  double min_kept_share = 0.65;  // of the last keyframe's points that are still tracked
  double max_interval_s = 1.0;   // while the rig moves
  // Where a keyframe has fewer points than this share of PointTrackerOptions::max_points, they are
  // averaged over more keyframes: at least one in sparse_interval_s.
  double sparse_share = 0.7;
  double sparse_interval_s = 0.25;
  double still_parallax_px = 1.0;      // with the rotation: below it the rig does not move
  double max_still_rate_rad_s = 0.05;  // mean, without bias: above it the rig turns
  void Check() const;
  void Read(YamlSection section);
};

struct InitializerOptions {
  double window_s = 0.6;                    // of data that initialisation in motion looks at
  int min_points = 20;                      // seen in the window's first and last image
  double max_still_flow_px = 1.0;           // at rest: median motion of the points over the window
  double max_still_accel_sigma_m_s2 = 0.3;  // at rest: deviation of the accelerometer
  double max_still_gyro_sigma_rad_s = 0.05;
  double max_gravity_error_m_s2 = 1.0;  // in motion: of the estimated gravity's size
  double max_reprojection_sigma = 3.2;  // RMS after optimisation, in standard deviations
  void Check() const;
  void Read(YamlSection section);
};

// What is estimated of the rig beside its motion: corrections of the calibration that was given,
// each with the standard deviation of what was given, which is where the estimate starts.
struct CalibrationOptions {
  bool time_offset = true;     // camera to IMU
  bool imu_rotation = true;    // the same
  bool lever = false;          // the same
  bool imu_scale = true;       // of accelerometer and gyroscope
  bool imu_axes = true;        // of the same: off the right angle, and turned against each other
  bool right_rotation = true;  // of the right camera against the left one
  bool focal_length = true;    // of both cameras in common
  bool right_centre = true;    // principal point of the right camera, against the left one's
  // Rows of rectified images are believed to fit while they do, and the right camera so to be as it
  // was calibrated: its turns about y and z are then tied to the given ones from the start (see
  // `confirm`), until the motion speaks against it. Where they do not, its turns are never tied:
  // what the check before the start found is off by some thousandths of a degree, which count in a
  // hall.
  bool rows_fit = true;
  // What agrees with the given calibration is taken to be as given while it does; see
  // window/calibration_ties.h.
  bool confirm = true;
  // How much further than the window claims its estimates are off, since what images err in is
  // common to neighbouring ones: 1.1 to 1.5 in exact simulated recordings.
  double sigma_scale = 1.5;
  double time_offset_sigma_s = 0.015;
  double imu_rotation_sigma_rad = 0.01;
  double lever_sigma_m = 0.003;
  double imu_scale_sigma = 0.015;  // relative; 1 to 3 % in phones and other low-cost IMUs
  double imu_axes_sigma_rad = 0.005;
  double right_rotation_sigma_rad = 0.002;
  double focal_length_sigma = 0.002;  // relative
  double right_centre_sigma_px = 2;
  // Beyond these an estimate is not believed, and the given value is used.
  double max_time_offset_s = 0.15;
  double max_imu_rotation_rad = 0.09;
  double max_lever_m = 0.1;
  double max_imu_scale = 0.12;  // of the three axes together
  double max_imu_axes_rad = 0.06;
  double max_right_rotation_rad = 0.02;
  double max_focal_length = 0.03;
  double max_right_centre_px = 5;  // beyond it the linear model of lens_shift.h is off
  void Check() const;
  void Read(YamlSection section);
};

struct FailureOptions {
  int min_points = 6;       // tracked; fewer are "lost"
  double max_lost_s = 2.0;  // without images, or thrice as long without points: a new segment
  double max_speed_m_s = 15;
  double max_gyro_bias_rad_s = 0.5;
  double max_accel_bias_m_s2 = 2.5;
  double max_imu_gap_s = 0.3;  // a longer one starts a new segment
  void Check() const;
  void Read(YamlSection section);
};

// LSD (von Gioi et al.) is the reference; OpenCV's FastLineDetector and EdgeDrawing are faster.
enum class LineDetectorKind { kLsd, kFld, kEd };

// Throws ConfigError naming the detectors there are.
LineDetectorKind LineDetectorFromName(const std::string& name);
std::string LineDetectorName(LineDetectorKind kind);

struct LineDetectorOptions {
  LineDetectorKind kind = LineDetectorKind::kEd;
  double scale = 0.5;           // of the image that is searched; edges are placed in the whole one
  double min_length_px = 30;    // after joining
  double max_join_gap_px = 30;  // between pieces of one edge
  int max_segments = 150;       // of an image, the longest
  void Check() const;
  void Read(YamlSection section);
};

struct LineMatcherOptions {
  int max_descriptor_bits = 60;          // of 256, between observations of one line
  double min_lead_bits = 10;             // of the best match before the second best
  double min_correlation = 0.85;         // of a line's profile with that of its last observation
  double min_stereo_correlation = 0.85;  // of the pictures beside the left and right segment
  double min_stereo_lead = 0.03;         // of the best correlation before the second best
  double max_disparity = 0.25;           // of the image's width
  void Check() const;
  void Read(YamlSection section);
};

struct LineTrackerOptions {
  LineDetectorOptions detector;
  LineMatcherOptions matcher;
  int max_lines = 60;        // followed at once; SLC-VIO keeps 35
  int max_misses = 3;        // calls in a row without an observation or a prediction
  double gate_sigmas = 3;    // across the line, about a prediction, and
  double min_gate_px = 1.5;  // added to them
  double predicted_angle_rad = 0.04;
  double max_parallax_px = 40;    // of a line without prediction, beyond the rotation
  double moved_angle_rad = 0.15;  // the same of its direction
  void Check() const;
  void Read(YamlSection section);
};

// Search for the headings of a building; see structure/manhattan_detector.h.
struct ManhattanOptions {
  double tilt_sigma_rad = 0.003;  // of the camera's poses against the vertical
  // Which segments vote.
  double min_length_px = 25;
  double full_weight_px = 200;        // a longer segment counts as this long
  double min_vertical_sigmas = 4;     // closer to the vertical than this it may be vertical
  double max_vote_sigma_rad = 0.035;  // of the heading that a segment says
  // The search.
  int memory_images = 30;            // keyframes whose votes are taken together
  double search_step_rad = 0.002;    // of the histogram
  double search_sigma_rad = 0.004;   // added to that of a vote
  double max_sigmas = 3;             // between a heading and a vote for it
  double min_separation_rad = 0.04;  // between headings
  // Closer to a heading, what is next to it are flanks of its own.
  double runner_up_separation_rad = 0.14;
  // When a heading is certain: its lines are the greater part, along both of its axes, or nearly
  // all, along one axis but on all sides of the camera, as in a corridor. Where none is known yet
  // one axis will do wherever it is seen, as of a colonnade, if its lines are the greater part for
  // long, not only below the camera, and no other heading comes near it.
  int min_images = 10;               // in which it has min_image_share
  int min_images_below = 25;         // where its lines are nearly all below the camera, as those
                                     // of things that stand about are
  double min_image_share = 0.4;      // of the segments that vote, by length
  double min_mean_length_px = 500;   // of the segments for it, an image
  double min_overhead_share = 0.05;  // above the camera; less is nearly all below
  double max_runner_up = 0.6;        // share of the next best heading over its own
  double min_share = 0.55;
  double min_minor_share = 0.12;  // along the axis with fewer lines
  double min_one_axis_share = 0.75;
  double min_spread = 0.45;  // 0: lines all to one side, 1: all around
  int min_images_one_axis = 25;
  double max_runner_up_one_axis = 0.3;
  // A heading is withdrawn when so many lines, and this share of all that were taken to follow it,
  // turned out not to.
  int min_given_up = 8;
  double max_given_up_share = 0.7;
  void Check() const;
  void Read(YamlSection section);
};

// To which direction of a building a line belongs; see structure/line_classifier.h.
struct LineClassifierOptions {
  // Of a segment's ends, across it, where one image alone has to say what the segment follows; of
  // the votes for headings too. What lenses and edges leave uncorrected does not average out there,
  // so it is more than LineLandmarkOptions::sigma_px, the weight of one observation among many.
  double end_sigma_px = 0.5;
  double direction_sigma_rad = 0.004;  // of the building's directions in the camera
  double max_sigmas = 3;               // between a line and the direction that it belongs to
  double max_angle_rad = 0.05;         // the same, however uncertain the line
  double min_other_sigmas = 5;         // between it and every other direction
  void Check() const;
  void Read(YamlSection section);
};

// Search for slopes, directions that lines share without being an axis of the building; see
// structure/slope_detector.h.
struct SlopeOptions {
  bool enabled = true;
  // Which lines vote: as their own observations have them.
  double min_length_m = 0.7;         // crates that lie about are shorter
  double max_line_sigma_rad = 0.02;  // of its direction
  // From the vertical, the level, the axes of the building and other slopes, and at least so many
  // standard deviations.
  double min_separation_rad = 0.05;
  double min_other_sigmas = 5;
  int memory_keyframes = 30;  // a line is remembered so long since it was last seen
  // Which lines agree.
  double search_sigma_rad = 0.005;  // of lines' own deviation from what they share
  double max_sigmas = 3;
  double max_angle_rad = 0.05;
  // When a slope is certain.
  int min_lines = 5;
  int min_objects = 3;        // that they belong to, and
  double min_apart_m = 0.25;  // these are so far from each other: a box has edges all around
  double max_sigma_rad = 0.01;
  // A slope is withdrawn when so many lines, and this share of all that were taken to follow it,
  // turned out not to.
  int min_given_up = 4;
  double max_given_up_share = 0.7;
  void Check() const;
  void Read(YamlSection section);
};

// Which points are taken to lie on lines; see structure/points_on_lines.h.
struct PointsOnLinesOptions {
  double max_distance_px = 1.2;    // across the line, in both images
  double min_apart_px = 2.0;       // farther away, a point is not on the line
  double max_beyond_px = 8;        // along the line, from its nearer end
  double min_crossing_rad = 0.35;  // between lines that share a point
  int min_keyframes = 4;           // in a row, until a membership is verified
  int max_unseen_keyframes = 20;   // then a candidate is forgotten
  double area_px = 48;             // side of the areas that points and lines are sorted into
  void Check() const;
  void Read(YamlSection section);
};

// When the place of a line is known; see window/line_triangulation.h.
struct LineTriangulationOptions {
  double max_relative_sigma = 0.25;      // of the line's place across it, to its distance
  double max_direction_sigma_rad = 0.2;  // of a general line
  double min_distance_m = 0.1;           // from the anchor
  double max_distance_m = 100;
  double loss_sigma = 2;  // where the Huber loss of an observation turns linear
  void Check() const;
  void Read(YamlSection section);
};

// How far lines are off the axes of the building that they follow; see
// structure/building_deviation.h.
struct BuildingDeviationOptions {
  // Standard deviation of a line's direction, about either axis across it, that is believed before
  // a line is known: DIN 18202 lets a wall be off by 0.1 to 0.2 degrees, a door frame by 0.15 to
  // 0.5, but most lines are well within. 0: lines are exactly along their axes.
  double start_sigma_rad = 0.0017;
  double start_lines = 0.5;  // so many known lines weigh as much as the start
  double min_sigma_rad = 0.00017;
  double max_sigma_rad = 0.017;
  // Below it the building is taken to be exact, and so are its lines but for one in so many, which
  // would tell if it were not.
  double exact_below_rad = 0.001;
  int probe_every = 4;
  // What lines of an axis have in common where they are near each other, as share of the variance.
  double shared_share = 0.5;
  double shared_radius_m = 3;
  // Walls bend: a line that may deviate is one piece as long as it is seen within this distance
  // along it from where it was first seen from.
  double max_piece_m = 3;
  double loss_sigma = 2;  // of a line's deviation, where the Cauchy loss turns
  double max_sigmas = 4;  // further off its axis, a line is given up: it follows none
  void Check() const;
  void Read(YamlSection section);
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
  int min_keyframes = 2;             // keyframes that saw a line before it is estimated
  int min_general_keyframes = 4;     // the same for a line of no axis
  // With structural and slc, lines of no axis are estimated too where lines are further off the
  // axes that they follow: in an exact building what follows no axis is clutter, in a crooked one
  // most of its edges.
  double general_above_rad = 0.0035;
  // Two lines of one axis are one where their distance is within so many standard deviations of
  // their places against each other, or below a least distance (conditional covariances make little
  // of what the lines share with the poses), and never above the largest: jambs of doors are 5 to
  // 8 cm wide.
  double merge_sigmas = 3;
  double min_merge_distance_m = 0.015;
  double max_merge_distance_m = 0.04;
  double max_apart_sigmas = 10;  // of sigma_px: seen side by side in one image they are two
  double point_sigma_m = 0.01;   // of a point's distance from the line it belongs to
  // How well a point and its line have to be known against each other, until it counts that they
  // agree.
  double max_member_sigma_m = 0.015;
  int max_unseen = 20;  // lines that are kept though the window sees them no longer
  LineTriangulationOptions triangulation;
  void Check() const;
  void Read(YamlSection section);
};

// Everything that odometry can be configured with. YAML sections carry the names of the members.
struct OdometryOptions {
  Method method = Method::kSlc;
  RectifierOptions rectifier;
  PointTrackerOptions points;
  WindowOptions window;
  KeyframeOptions keyframes;
  InitializerOptions initializer;
  CalibrationOptions calibration;
  FailureOptions failure;
  LineTrackerOptions lines;
  ManhattanOptions manhattan;
  LineClassifierOptions line_classifier;
  SlopeOptions slopes;
  PointsOnLinesOptions points_on_lines;
  LineLandmarkOptions line_landmarks;
  BuildingDeviationOptions building_deviation;

  // Overrides the defaults with those of a file; throws ConfigError naming file and key.
  static OdometryOptions FromYaml(const std::string& path);
  // All options as such a file.
  std::string ToYaml() const;
  void Check() const;
};

}  // namespace slcmap
