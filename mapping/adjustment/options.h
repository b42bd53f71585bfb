// The options of the adjustment over all keyframes of a run.
#pragma once

#include "data/io/yaml.h"
#include "odometry/factors/options.h"
#include "odometry/structure/options.h"

namespace slcmap::inline mapping {

// Of closures: shifts so far apart are two, so many keyframes have to recognise a place alike, and
// how far an edge that is seen again is off.
inline constexpr double kClosureMinDisplacement_m = 0.025;
inline constexpr int kClosureMinKeyframes = 3;
inline constexpr double kClosureEdgeSigma_m = 0.004;
// That saw a point: fewer tell nothing of their poses.
inline constexpr int kAdjustmentMinPointKeyframes = 2;

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
  // Matches have to agree on one shift.
  int min_edges = 4;  // along two axes at least, or
  int min_points = 15;
  double point_tolerance_px = 2;
  // By points, evenly along the way: each ties keyframes far apart, which fills the adjustment's
  // equations, and of a long recording a few tell as much.
  int max_point_closures = 60;
  // In the adjustment.
  double point_sigma_px = 0.25;
  double loss_sigma = 2;  // where the Cauchy loss turns
  void Check() const;     // throws ConfigError
  void Read(YamlSection section);
};

struct AdjustmentOptions {
  bool enabled = true;
  // Where no place is recognised again the run stays as the window has it.
  bool needs_revisit = false;
  // Standard deviations of what was measured, as the window has them, and where robust losses turn,
  // in standard deviations.
  double point_sigma_px = 0.25;
  double line_sigma_px = 0.2;
  // Directions of lines, as BuildingDeviationOptions has them. Where they may deviate, by so many
  // times what the run has learned of single lines: they are off together in more ways than those
  // that shares hold (all edges of one door, a wall that bends), which does not average out.
  double deviation_scale = 2;
  double exact_below_rad = 0.001;
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
