// The options of the front end: the rectifier, points and lines in images.
#pragma once

#include <string>

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

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

}  // namespace slcmap::odometry
