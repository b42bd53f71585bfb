// Pipes among the lines of a map, which may be their outlines.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/lines/line_samples.h"
#include "mapping/map/map.h"
#include "mapping/pipes/pipe_fit.h"

namespace slcmap::inline mapping {

// A line of the map, with all of its pieces.
struct Outline {
  int64_t line_id = 0;
  int segment = 0;
  LineAxis axis = LineAxis::kNone;
  int world = -1;
  PointAndDirection line;  // its point in the middle
  double half_m = 0;       // from there to its ends
  std::vector<Interval> pieces;
  double sigma_m = 0;
  std::vector<TangentRay> rays;  // to the ends of where each image has it
};

// Those of the lines and marks that images show. Images are numbered by their order in the
// evidence.
std::vector<Outline> CollectOutlines(const MapResult& map, const PipeOptions& options);

struct PipeCandidate {
  PipeFit fit;
  std::vector<size_t> outlines;
  double from_m = 0, to_m = 0;  // along its axis from its point, where outlines show it
};

// All that two lines may be the outlines of, with the others that touch it; those found so far once
// progress says so.
std::vector<PipeCandidate> PipeCandidates(const std::vector<Outline>& outlines,
                                          const PipeOptions& options,
                                          const Progress& progress = {});

// The share of an outline's rays that touch the cylinder.
double TouchingShare(const Cylinder& cylinder, const Outline& outline, const PipeOptions& options);

}  // namespace slcmap::mapping
