// The lines of a map while they are being made, the directions that lines of a building run along,
// and what the surfaces beside a line are like.
#pragma once

#include <cstdint>
#include <vector>

#include "data/core/types.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_samples.h"
#include "mapping/map/map.h"
#include "mapping/map/point_index.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

struct BuildingAxis {
  LineAxis axis = LineAxis::kVertical;
  int world = -1;    // as Line::world
  int segment = -1;  // of the run that it holds in; -1: all
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();
  double sigma_rad = 0;  // of a line's direction from it
};

// The vertical, then X and Y of the run's Manhattan worlds and its slopes, but those withdrawn.
// Lines may be off them by 1.4 times what the run has learned of its building, and by min_sigma_rad
// at least.
std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad);

// A line whose direction counts towards that of the building.
struct DirectedLine {
  Eigen::Vector3d direction_world;  // unit, either way round
  double length_m = 0;
  double sigma_rad = 0;
};

// The axes of a building whose lines are known and whose heading is not: the vertical, which is the
// mean of the lines near the world's z, and the headings that the level lines share (to a quarter
// turn), those with most length first. Without lines the vertical alone, which is z.
std::vector<BuildingAxis> FindAxes(const std::vector<DirectedLine>& lines);

// How much of a line is on a flat surface that goes on at both of its sides, and of how much is
// another known: that it ends there, bends, or is partly hidden by one in front of it.
struct SurfacesBeside {
  double flat_m = 0, relief_m = 0, unknown_m = 0;
};

// The surfaces that a dense cloud shows, to be asked for at many lines.
class LineSurfaces {
 public:
  explicit LineSurfaces(const std::vector<DensePoint>& cloud);

  // In intervals of 10 cm, by the points up to 15 cm around them.
  SurfacesBeside Beside(const PointAndDirection& line,
                        const std::vector<Interval>& intervals) const;

 private:
  enum class Surface { kFlat, kRelief, kUnknown };
  Surface At(const Eigen::Vector3d& p_world, const Eigen::Vector3d& direction_world) const;

  std::vector<DensePoint> cloud_;
  PointTree index_;
};

// How many views look at a bin of a line, and how many of them show its edge.
struct BinViews {
  uint16_t shown = 0, missed = 0;
  float max_depth_m = 0;  // from which it is looked at
};

struct TrackedLine {
  int axis = -1;          // index into the building's axes; -1: none
  bool is_level = false;  // of one without an axis: its direction is held level
  int segment = 0;        // of the run
  int map = 0;            // where lines of several maps are merged
  // Runs so that the bright side is on the left of its image in the view that it was found in.
  PointAndDirection line;
  Interval seen;        // by segments, until it is fitted in its intervals
  double gradient = 0;  // of its edge, grey values a pixel, where it was found
  LineFit fit;
  std::vector<EdgePoint> places;
  // Of the samples that show its edge; these.
  double step_sum = 0, lasting_sum = 0, brightness_sum = 0;
  SurfacesBeside surfaces;
  int parallels = 0;           // lines beside it, see line_kinds.h
  double trim = 0;             // how much of a crease is beneath it, as under a skirting
  std::vector<BinViews> bins;  // from bins_from_m on, until it is fitted too
  double bins_from_m = 0;
  std::vector<Interval> intervals;
};

}  // namespace slcmap::mapping
