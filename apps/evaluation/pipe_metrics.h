// How good the pipes of a map are.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/io/map_line.h"
#include "mapping/map/map.h"

namespace slcmap::inline evaluation {

struct PipeMetrics {
  int64_t pipes = 0;                    // true ones that were seen so far
  int64_t found = 0;                    // of these
  int64_t found_axes = 0;               // of these, whatever the radius
  int64_t mapped = 0, false_pipes = 0;  // that are no true one, seen or not
  double seen_m = 0, found_m = 0;       // lengths seen, of all and of those that were found
  // Of those that were found; kNoFigure without any.
  double radius_median_m = 0, radius_95_m = 0;
  double axis_median_m = 0;
};

std::vector<MapPipe> Aligned(const Alignment& alignment, std::vector<MapPipe> pipes);

PipeMetrics EvaluatePipes(const std::vector<TruePipe>& truth, const std::vector<MapPipe>& pipes);

// Of truth/pipes.csv of a simulated sequence, and pipes.json of a map.

std::string PipeTable(const ComparedFiles& inputs, const PipeMetrics& metrics);
nlohmann::ordered_json PipeJson(const ComparedFiles& inputs, const PipeMetrics& metrics);

}  // namespace slcmap::evaluation
