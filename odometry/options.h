// The options of every module of odometry: defaults here, overridden by YAML, checked when built.
#pragma once

#include <string>

#include "data/yaml_options.h"

namespace slcmap {

// Landmarks and sensors in use; see README.md, "Methods".
enum class Method { kPointsMono, kPoints };

// Throws ConfigError naming the methods there are.
Method MethodFromName(const std::string& name);
std::string MethodName(Method method);

struct RectifierOptions {
  double max_field_of_view_rad = 2.1;  // of the rectified image's width; matters for fisheye only
  void Check() const;                  // throws ConfigError
  void Read(YamlSection section);
};

struct PointTrackerOptions {
  int max_points = 150;
  double min_distance_px = 20;
  int pyramid_levels = 4;
  int patch_px = 15;
  double max_forward_backward_px = 0.7;
  double max_epipolar_px = 1.5;  // left to right, across the rectified row
  double min_corner_quality = 1e-3;
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap
