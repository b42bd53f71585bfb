// The options of the front end: the rectifier, points and lines in images.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

// Of a line's profile with that of its last observation
inline constexpr double kMatcherMinCorrelation = 0.85;

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
  double min_corner_gradient = 1;  // grey values a pixel, across the direction of least texture
  void Check() const;
  void Read(YamlSection section);
};

// LSD (von Gioi et al.) is the reference; OpenCV's FastLineDetector and EdgeDrawing are faster.
enum class LineDetectorKind { kLsd, kFld, kEd };

struct LineDetectorOptions {
  LineDetectorKind kind = LineDetectorKind::kEd;
  double scale = 0.5;           // of the image that is searched; edges are placed in the whole one
  double min_length_px = 30;    // after joining
  double max_join_gap_px = 30;  // between pieces of one edge
  int max_segments = 150;       // of an image, the longest
  void Check() const;
  void Read(YamlSection section);
};

struct LineTrackerOptions {
  LineDetectorOptions detector;
  int max_lines = 60;  // followed at once; SLC-VIO keeps 35
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap::odometry
