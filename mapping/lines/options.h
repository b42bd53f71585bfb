// The options of the line stage, also of what lines tell of the directions of those near them (see
// guided_pass.h).
#pragma once

#include "data/io/yaml.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/line_sweep.h"
#include "mapping/views/views_between.h"

namespace slcmap::inline mapping {

// A building bends and leans as a whole, and what is fitted into it stands askew as a whole: how
// far lines of one axis are off it is alike where they are near each other.
struct NeighbourOptions {
  // Of the variance of lines about their axis: what all of them share, and what those near each
  // other do, less by exp(-distance / reach_m). The rest is a line's own.
  double building_share = 0.3, shared_share = 0.4;
  double reach_m = 3;
  int max_neighbours = 40;  // of a line, the nearest ones
};

// The bins of a line that belong to it.
struct LineIntervalOptions {
  double bin_m = 0.02;
  double max_gap_m = 0.1;     // that is closed, where nothing was observed
  double min_length_m = 0.1;  // of an interval
  int min_views = 3;          // that show a bin's edge
  double min_share = 0.4;     // of the views that look at a bin: not all that hides it is known
};

struct LineMergingOptions {
  // Between lines, in the direction of what they are apart, as fits know them, whose places of one
  // image err alike.
  double max_sigmas = 6;
  double max_distance_m = 0.03;   // where lines lie beside each other
  double min_distance_m = 0.006;  // up to which they are the same however well they are known
};

// See line_kinds.h.
struct LineKindOptions {
  // Of the step of brightness across a line, the share that is there some pixels from it, too.
  double min_lasting_step = 0.4, max_lasting_step = 1.9;
  // Some pixels from a line on a flat surface, of the mean brightness of both sides: how bright the
  // light is and how long the exposure does not matter.
  double min_outline_step = 0.25;
  // The same beside the line, of a step that need not last: frames and trims are narrow, but stand
  // out more than grain and joints do.
  double min_trim_step = 0.45;
  // A line with so many others beside it and up to so far away needs a step that lasts and is as
  // large as this, or that of a trim, beside any surface, and however long: bricks, tiles, boards
  // and grain lie side by side.
  double min_textured_step = 0.4;
  int texture_lines = 4;
  double texture_reach_m = 0.4;
  double min_known_share = 0.3;  // of a line beside which surfaces are known
  double min_flat_share = 0.6;   // of that, of a line on a flat surface
};

struct MapLineOptions {
  double min_segment_px = 19;
  int max_segments = 1000;          // of an image, the longest; halls show 700
  double min_gradient = 2.5;        // grey values a pixel, of an edge
  double min_gradient_share = 0.4;  // of what a line's edge has where it was found
  double axis_distance_px = 1.8;    // of a segment's ends from an axis' image through its middle
  double explained_px = 1.8;        // of a segment's ends from the image of a line that is known
  double max_depth_m = 10;          // up to which views are looked at for a line
  double max_found_sigma_m = 0.06;  // across a line that is looked for in all views
  double max_sigma_m = 0.025;       // across a line that is kept
  // Of the places of a line that is kept about it, in the images (LineFit); without an axis.
  double max_spread_px = 0.42, max_free_spread_px = 0.24;
  int min_views = 3;  // of a line that is kept; twice as many without an axis
  double min_axis_sigma_rad = 0.0005;
  double level_sigma_rad = 0.005;  // of level lines without an axis
  ViewSpacingOptions views;
  LineSweepOptions sweep;
  LineFitOptions fit;
  NeighbourOptions neighbours;
  LineIntervalOptions intervals;
  LineMergingOptions merging;
  LineKindOptions kinds;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);

  // For images that agree with their poses to `across_px` (PoseAgreement): what a line's places may
  // be off grows with it, from 0.15 px on: simulated images and good poses have 0.1.
  MapLineOptions ForPoses(double across_px) const;
};

}  // namespace slcmap::mapping
