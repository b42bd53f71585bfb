// The options of the adjustment over all keyframes of a run.
#pragma once

#include "data/io/yaml.h"
#include "odometry/factors/options.h"
#include "odometry/structure/options.h"

namespace slcmap::inline mapping {

// How visits are recognised, and what may be believed of them.
struct ClosureOptions {
  bool enabled = true;
  // Besides edges, points are searched in the images, where these are there.
  bool points = true;
  // Between visits. What is seen again sooner is followed by odometry.
  double min_path_m = 5;
  double min_interval_s = 8;
  // Odometry's uncertainty between visits, three standard deviations: of a position, at least and
  // with the path; of the heading likewise. Beyond it nothing is looked for: doors a metre apart
  // and identical storeys are excluded by this alone.
  double gate_m = 0.02;
  double gate_per_m = 0.0006;
  double gate_rad = 0.002;
  double gate_rad_per_m = 0.0001;
  // Matches have to agree on one shift.
  int min_edges = 4;  // along two axes at least, or
  int min_points = 15;
  double min_lead = 1.5;  // of its votes over those of any other shift, further off than
  double min_displacement_m = 0.025;
  double edge_tolerance_m = 0.01;  // of an edge from where the shift has it
  double point_tolerance_px = 2;
  double min_correlation = 0.8;  // of a point's patch with where it is seen again
  int min_keyframes = 3;         // that recognise a place alike
  // By points, evenly along the way: each ties keyframes far apart, which fills the adjustment's
  // equations, and of a long recording a few tell as much.
  int max_point_closures = 60;
  // In the adjustment.
  double edge_sigma_m = 0.004;
  double point_sigma_px = 0.25;
  double loss_sigma = 2;      // where the Cauchy loss turns
  double min_agreeing = 0.6;  // of a closure's matches, that fit at the end; else it is taken back
  double max_link_chi2 = 35;  // of odometry's links (15 rows); more, and closures are taken back
  void Check() const;         // throws ConfigError
  void Read(YamlSection section);
};

struct AdjustmentOptions {
  bool enabled = true;
  // Where no place is recognised again the run stays as the window has it.
  bool needs_revisit = false;
  // Standard deviations of what was measured, as the window has them, and where robust losses turn,
  // in standard deviations.
  double point_sigma_px = 0.25;
  double point_loss_sigma = 0.5;
  double line_sigma_px = 0.2;
  double line_loss_sigma = 0.5;
  double max_point_chi2 = 12;  // of one camera's observation (2 rows) that is kept
  double max_line_chi2 = 16;
  int min_point_keyframes = 2;  // that saw a point: fewer tell nothing of their poses
  // So many observations of one edge count in full; more share their weight, since what one edge
  // errs in (a wall that bends, a calibration that is off) does not average out over its views.
  int line_observations = 10;
  // A line that more keyframes saw stays in the reduced system, which eliminating it would fill.
  int max_eliminated_observations = 50;
  // Directions of lines, as BuildingDeviationOptions has them. Where they may deviate, by so many
  // times what the run has learned of single lines: they are off together in more ways than those
  // that shares hold (all edges of one door, a wall that bends), which does not average out.
  double deviation_scale = 2;
  double exact_below_rad = 0.001;
  double shared_share = 0.5;
  double shared_radius_m = 3;
  double axis_loss_sigma = 2;
  // The standard deviations are those that the run itself shows, but within these shares of the
  // ones above.
  double min_scatter = 0.4, max_scatter = 2;
  int max_iterations = 10;  // of each of the solver's rounds, twice as many with closures
  CalibrationOptions calibration;
  ClosureOptions closures;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
