// How well a cloud of points shows the true surfaces of a building.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/evaluation/alignment.h"
#include "apps/evaluation/seen_surfaces.h"

namespace slcmap {

struct EvaluatedCloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> sources;  // by point: 0 stereo, 1 filled plane
};

// The vertices of a PLY file, with the property `source` where it has one (else 0). Throws
// DataError.
EvaluatedCloud ReadEvaluatedCloud(const std::string& path);

// The cloud laid over the truth, as the trajectory was.
EvaluatedCloud Aligned(const Alignment& alignment, EvaluatedCloud cloud);

// Shares at one tolerance. Accuracy: points with a true surface, seen or not, within it.
// Completeness: samples of the surfaces seen within a range that have a point within it. F is the
// harmonic mean of the two. Each is kNoFigure where it would be of nothing.
struct CloudScore {
  double tolerance_m = 0;
  double accuracy = 0;
  double filled_accuracy = 0;           // of the points of source 1
  std::vector<double> completeness, f;  // by range
};

struct CloudMetricOptions {
  std::vector<double> tolerances_m = {0.02, 0.05, 0.1, 0.2};
  std::vector<double> ranges_m = {4, 8};  // ascending, at most what views were cast to
  double nearby_m = 0.12;                 // some samples, and less than most walls are thick
};

struct CloudMetrics {
  int64_t points = 0, filled = 0;
  double rms_m = 0;        // distance of points to surfaces, those beyond 20 cm left out;
                           // kNoFigure where no point is nearer
  double filled_seen = 0;  // share of the filled points with a sample of what was seen nearby:
                           // others are guessed, however near a surface they are; kNoFigure of none
  std::vector<int64_t> seen_samples;  // of the surfaces, by range
  std::vector<CloudScore> scores;     // by tolerance
};

// Compares points with surfaces in the same world.
CloudMetrics EvaluateCloud(const TriangleTree& surfaces, const std::vector<SeenSample>& seen,
                           const EvaluatedCloud& cloud, const CloudMetricOptions& options);

}  // namespace slcmap
