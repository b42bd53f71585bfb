// The lines of a map as what they may be: outlines of pipes.
#pragma once

#include <vector>

#include "mapping/lines/line_in_view.h"
#include "mapping/map.h"
#include "mapping/pipes/pipe_fit.h"
#include "mapping/pipes/pipe_options.h"

namespace slcmap {

// A line of the map, with all of its pieces.
struct Outline {
  int64_t line_id = 0;
  int segment = 0;
  LineAxis axis = LineAxis::kNone;
  int world = -1;
  PointAndDirection line;  // its point in the middle
  double half_m = 0;       // from there to its ends
  std::vector<Stretch> pieces;
  double sigma_m = 0;
  std::vector<TangentRay> rays;  // to the ends of where each image has it
};

// Those of the lines and marks that images show. Images are numbered by their order in the
// evidence.
std::vector<Outline> OutlinesOf(const MapResult& map, const PipeOptions& options);

}  // namespace slcmap
