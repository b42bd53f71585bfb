// The options of the line stage, also of what lines tell of the directions of those near them (see
// guided_pass.h).
#pragma once

#include "data/io/yaml.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/line_sweep.h"
#include "mapping/views/views_between.h"

namespace slcmap::inline mapping {

// Up to which lines may be the same, where they lie beside each other.
inline constexpr double kMergeMaxDistance_m = 0.03;

// A building bends and leans as a whole, and what is fitted into it stands askew as a whole: how
// far lines of one axis are off it is alike where they are near each other.
struct NeighbourOptions {
  // Of the variance of lines about their axis: what all of them share, and what those near each
  // other do, less by exp(-distance / reach_m). The rest is a line's own.
  double building_share = 0.3, shared_share = 0.4;
  double reach_m = 3;
  int max_neighbours = 40;  // of a line, the nearest ones
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
  NeighbourOptions neighbours;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);

  // For images that agree with their poses to `across_px` (PoseAgreement): what a line's places may
  // be off grows with it, from 0.15 px on: simulated images and good poses have 0.1.
  MapLineOptions ForPoses(double across_px) const;
};

}  // namespace slcmap::mapping
