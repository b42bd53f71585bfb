// The options of dense mapping.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct DenseOptions {
  int threads = 2;  // results are the same with any, so files do not hold it

  // Views that are looked at: so far from the one before, or turned by as much.
  double min_travel_m = 0.1;
  double min_turn_rad = 0.1;

  // Depth of one view.
  double min_depth_m = 0.4;
  double max_depth_m = 10;
  int grid_px = 5;              // between the pixels of an image whose depth is estimated
  int uniqueness_percent = 5;   // by which the best disparity beats all others
  double max_grazing_deg = 75;  // between a surface's normal and the ray to it
  double pair_sigma_px = 0.08;  // what the calibration lets the right image be off
  double pose_sigma_px = 0.15;  // what poses let the image of another view be off
  int neighbours = 3;           // views whose images refine the depth of one

  // What is kept.
  int window_views = 8;         // on either side, that may confirm a view's depth
  int min_views = 3;            // that agree, itself among them
  double min_baseline_m = 0.1;  // between those that count
  double agree_sigmas = 2;
  double voxel_m = 0.04;
  double max_sigma_m = 0.1;  // of one view's depth

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
