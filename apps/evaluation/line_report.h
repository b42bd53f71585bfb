// Line metrics as a table to read, as JSON to compute with, and as a plan to look at.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/evaluation/line_metrics.h"

namespace slcmap {

// What was compared; stands at the head of both forms.
struct LineInputs {
  std::string true_edges, lines;  // paths
};

std::string LineTable(const LineInputs& inputs, const LineMetrics& metrics);
nlohmann::ordered_json LineJson(const LineInputs& inputs, const LineMetrics& metrics);

// Writes an SVG document: the seen parts of the true edges (grey) and the lines, coloured by axis,
// from above. Throws OutputError.
void WriteLinePlan(const std::string& path, const TrueEdges& truth,
                   const std::vector<MapLine>& lines);

}  // namespace slcmap
