// Lines that are near to each other, and the gaps between mapped lines of one edge.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/io/map_line.h"
#include "data/io/ply.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {

class SegmentIndex {
 public:
  // How a point with a direction lies to the segment found.
  struct Match {
    double distance_m = 0;
    double angle_rad = 0;  // between the directions, in [0, pi / 2]: a segment has no sense
    std::size_t segment = 0;
  };

  // All segments must have an extent.
  explicit SegmentIndex(std::vector<PlySegment> segments);

  // The nearest of the segments within both limits; distances are to the segment, not to its line.
  // `direction` has length 1.
  std::optional<Match> Nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                               double max_distance_m, double max_angle_rad) const;

 private:
  std::vector<PlySegment> segments_;
  std::vector<std::size_t> segment_of_;  // by point of the tree
  PointTree tree_;
};

// Whether a line map keeps apart what is apart: the gaps of edges in open doorways, as of
// skirtings, and edges that lie close beside each other, as the two of a jamb.

// Of what the map shows on both sides: a gap is one in an open doorway where lines lie along both
// edges next to it and no edge in it, a pair one where a line lies along one of the two at least,
// both seen clearly.
struct LineGaps {
  int gaps = 0;
  int gaps_kept = 0;  // hardly a line goes through
  int pairs = 0;
  int pairs_kept = 0;  // each edge has a line nearer to it than a third of their distance
  int jambs = 0;       // of these pairs
  int jambs_kept = 0;
};

// Gaps are in truth.doorways, pairs of truth.clear, jambs at truth.openings; none where these are
// not known.
LineGaps EvaluateLineGaps(const TrueEdges& truth, const std::vector<MapLine>& lines);

}  // namespace slcmap::evaluation
