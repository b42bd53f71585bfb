// Mapped lines against true edges: metrics, table, JSON and plan.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "data/core/progress.h"
#include "data/io/map_line.h"

namespace slcmap::inline evaluation {

struct LineMetricOptions {
  double sample_m = 0.02;     // between samples along mapped lines and true edges
  double max_angle_deg = 10;  // between a sample's direction and that of what it is compared with
  std::vector<double> tolerances_m = {0.01, 0.02, 0.05, 0.1, 0.2};  // ascending
  int max_samples = 10000000;                                       // of lines and edges together
  void Check() const;                                               // throws ConfigError
};

// What is right up to a tolerance. A mapped sample is correct when a true edge (one that was seen,
// over its whole length) of nearly its direction is within the tolerance; a sample of the seen
// parts is covered when a mapped line of nearly its direction is. Shares of nothing are kNoFigure.
struct LineScore {
  double tolerance_m = 0;
  double recall_m = 0;                 // covered length of the seen parts
  double recall = 0;                   // as a share of their length
  std::optional<double> clear_recall;  // share of the clearly seen length that is covered
  double correct_m = 0;                // correct length of the mapped lines
  double precision = 0;                // as a share of their length
  double redundancy = 0;               // mapped length over covered length, 1 is ideal
};

// Over the mapped samples that are correct at the largest tolerance, each compared with the nearest
// true edge of nearly its direction; where that is bent, directions with that of its part beside
// the line.
struct LineAccuracy {
  double length_m = 0;  // of those samples
  double direction_mean_deg = 0;
  double direction_rms_deg = 0;
  double offset_rms_m = 0;  // distance to the edge
};

// Of lines whose kind was told: what was called which by length, at the tolerance of a score. A
// line is an edge's where a sample of it is correct. Shares of nothing are kNoFigure.
struct KindScore {
  double tolerance_m = 0;
  double marks_called_edges = 0;  // share of what is no edge's
  double edges_called_marks = 0;  // share of what is an edge's
};

struct LineMetrics {
  int64_t lines = 0;           // mapped
  int64_t without_extent = 0;  // of them; they count for nothing
  double mapped_length_m = 0;
  double seen_length_m = 0;              // of the true edges
  std::optional<double> clear_length_m;  // of their parts that were seen well, where known
  std::vector<LineScore> scores;         // by tolerance
  std::optional<LineAccuracy> accuracy;  // nothing where no sample is correct
  double marks_length_m = 0;
  std::vector<KindScore> kinds;  // by tolerance; none of a map without marks
};

// Compares lines with edges in the same world. Throws DataError when their lengths take more than
// max_samples, and StoppedError when progress says so.
LineMetrics EvaluateLines(const TrueEdges& truth, const std::vector<MapLine>& lines,
                          const LineMetricOptions& options, const Progress& progress = {});

// Adds how the map told its lines from marks, which are to be on no edge.
void EvaluateMarks(const TrueEdges& truth, const std::vector<MapLine>& marks,
                   const LineMetricOptions& options, LineMetrics* metrics,
                   const Progress& progress = {});

// The lines laid over the truth, as the trajectory was.
std::vector<MapLine> Aligned(const Alignment& alignment, std::vector<MapLine> lines);

// Line metrics as a table to read, and as JSON to compute with.

nlohmann::ordered_json LineJson(const ComparedFiles& inputs, const LineMetrics& metrics);

}  // namespace slcmap::evaluation
