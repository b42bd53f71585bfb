// The options of which images are looked at, and of their depth.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

struct ViewSpacingOptions {
  bool between_keyframes = true;  // else keyframes alone
  double min_travel_m = 0.15;     // from the view before and to the next keyframe, or
  double min_turn_rad = 0.2;      // as much as that
  // Of views that look from one place the same way, to 0.3 m and 0.35 rad, so many are enough:
  // long recordings pass where they have been again and again.
  int max_alike = 12;
};

// The options of dense mapping.
struct DenseOptions {
  // Views that are looked at: so far from the one before, or turned by as much.
  double min_travel_m = 0.1;
  double min_turn_rad = 0.1;

  // Depth of one view.
  double min_depth_m = 0.4;
  double max_depth_m = 10;
  int grid_px = 5;              // between the pixels of an image whose depth is estimated
  double pair_sigma_px = 0.08;  // what the calibration lets the right image be off

  // What is kept.
  double voxel_m = 0.04;
  double max_sigma_m = 0.1;  // of one view's depth

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
