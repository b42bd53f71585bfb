// The options of the pipe stage.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

struct PipeFitOptions {
  double robust_sigmas = 2;     // at which a ray counts half (Cauchy)
  int images_that_count = 10;   // more images of one pipe share their errors
  double direction_rad = 0.05;  // from the start: weakly held there
};

struct PipeOptions {
  bool find = true;
  double min_radius_m = 0.015, max_radius_m = 0.32;
  // The outlines of a square bar are up to a sixth of the radius off those of a pipe: of thinner
  // ones that is less than twice what rays are off at 2 m. Only how wide images show them tells
  // these.
  double min_outlined_radius_m = 0.035;
  double min_length_m = 0.75;
  double sigma_px = 0.4;        // of where an image has an outline
  double pose_sigma_m = 0.002;  // of the views against each other
  double max_turn_rad = 0.05;   // between lines that are outlines of one pipe
  double max_off_sigmas = 3;    // of a ray that touches the pipe
  double min_touching = 0.75;   // share of the rays to an outline
  // Share of the images that show outlines on both sides; less is enough where the cloud is round.
  double min_both_sides = 0.4;
  // Of the misfit of the cylinder: that of fixed edges in its place is at least so much more.
  double min_gain = 1.3;
  // Of the median distance of points of the cloud from a pipe that they alone tell, in radii; and
  // of one that its outlines tell.
  double max_surface_off = 0.12, max_outlined_off_m = 0.05;
  PipeFitOptions fit;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
