// The lines of a map while they are being made.
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/lines/building_axes.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_in_view.h"
#include "mapping/lines/line_surfaces.h"

namespace slcmap {

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
  Stretch seen;         // by segments, then from the first interval to the last
  double gradient = 0;  // of its edge, grey values a pixel, where it was found
  LineFit fit;
  double moved_m = 0;  // at most, along its intervals, by the last fit again
  std::vector<EdgePlace> places;
  // Of the samples that show its edge; these.
  double step_sum = 0, lasting_sum = 0, brightness_sum = 0;
  int shown_samples = 0;
  SurfacesBeside surfaces;
  int parallels = 0;           // lines beside it, see line_texture.h
  std::vector<BinViews> bins;  // from bins_from_m on
  double bins_from_m = 0;
  std::vector<Stretch> intervals;
};

}  // namespace slcmap
