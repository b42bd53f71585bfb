// The options of the adjustment of poses that were given.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct GivenPoseOptions {
  bool adjust = true;
  // Poses that images agree with so well stay as they are: the median over pairs of views of how
  // far points are, by their median, from where poses have them.
  double good_px = 0.3;
  // What poses may be off on their own: of a tracker or a total station, its calibration against
  // the camera and their clocks make most of it.
  double sigma_m = 0.01, sigma_rad = 0.01;
  double point_sigma_px = 0.5;                    // of where a point is found in another view
  double disparity_sigma_px = 0.25;               // of its depth
  double robust_sigmas = 2;                       // at which a point counts half (Cauchy)
  int partners = 8;                               // views that points of one are looked for in
  double max_travel_m = 1.5, max_turn_rad = 0.5;  // to them
  int rounds = 2;                                 // of looking for points, and adjusting
  int max_iterations = 20;
  int threads = 2;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
