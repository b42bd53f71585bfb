// Finds the segment of nearly the same direction that is nearest to a point.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "data/ply.h"

namespace slcmap {

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
  ~SegmentIndex();

  // The nearest of the segments within both limits; distances are to the segment, not to its line.
  // `direction` has length 1.
  std::optional<Match> Nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                               double max_distance_m, double max_angle_rad) const;

 private:
  struct Tree;
  std::vector<PlySegment> segments_;
  std::unique_ptr<Tree> tree_;  // none without segments
};

}  // namespace slcmap
