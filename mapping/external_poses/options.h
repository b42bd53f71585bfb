// The options of the adjustment of poses by others.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

struct ExternalPoseOptions {
  bool adjust = true;
  // What all poses may be off alike: the body that was tracked against the rig's IMU, and its clock
  // against the images'.
  double sigma_m = 0.005, sigma_rad = 0.005;  // of each pose on top of that
  double point_sigma_px = 0.5;                // of where a point is found in another view
  // Of its depth: loose, as far points of all pairs share errors of a tenth of a pixel, which would
  // bend the way. How far views are apart is told by the poses.
  int max_iterations = 20;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
