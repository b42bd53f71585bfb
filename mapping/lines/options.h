// The options of the line stage.
#pragma once

#include "data/io/yaml.h"
#include "mapping/views/options.h"

namespace slcmap::inline mapping {

struct LineFitOptions {
  // Of a place of four samples and more, in the view that is nearest to the line. From afar edges
  // that lie side by side run together: there it is larger by a power of how much farther it is.
  // The nearest view of an interval counts as at most so many times farther than that of the line,
  // which may be a glimpse of one end.
  double sigma_px = 0.18, far_power = 2, most_times_farther = 1.5;
  // Of a line, over which one view is the nearest, and the places of one image err alike.
  double stretch_m = 0.25;
  double pose_sigma_m = 0.002;  // of the views against each other
  int views_that_count = 10;    // more views of one line share their errors
  // Across a line, what all its views share: drift of the poses, and an edge that is not quite
  // where images show it.
  double shared_sigma_m = 0.003;
};

struct LineSweepOptions {
  double max_depth_m = 10;
};

struct MapLineOptions {
  double min_segment_px = 19;
  double max_depth_m = 10;     // up to which views are looked at for a line
  double max_sigma_m = 0.025;  // across a line that is kept
  // Of the places of a line that is kept about it, in the images (LineFit); without an axis.
  double max_spread_px = 0.42, max_free_spread_px = 0.24;
  int min_views = 3;  // of a line that is kept; twice as many without an axis
  double min_axis_sigma_rad = 0.0005;
  ViewSpacingOptions views;
  LineSweepOptions sweep;
  LineFitOptions fit;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);

  // For images that agree with their poses to `across_px` (PoseAgreement): what a line's places may
  // be off grows with it, from 0.15 px on: simulated images and good poses have 0.1.
  MapLineOptions ForPoses(double across_px) const;
};

}  // namespace slcmap::mapping
