// What a map knows of its lines besides what MapLine says: how well each is known along its
// length, and which images show it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <tuple>
#include <vector>

#include "data/types.h"

namespace slcmap {

// A piece of a line is one of the MapLines that share its id: they count from 0, in their order.

// What the ends of a piece may be off across the line, in the axes of the world; along it they
// say how far it was seen, so nothing is said of that. The displacement of the place at the share t
// of the way from start to end is (1 - t) times that of the start and t times that of the end.
struct LineCovariance {
  int64_t line_id = 0;
  int piece = 0;
  Eigen::Matrix3d start_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d end_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d start_end_m2 = Eigen::Matrix3d::Zero();  // rows: the start's x, y, z
};

// The edge of a piece in a rectified image: how far it was seen there.
struct LineSupport {
  int64_t line_id = 0;
  int piece = 0;
  int64_t stamp_ns = 0;  // of the image
  int camera = 0;        // 0 left, 1 right
  LineSegment px;
};

// What they are ordered by.
inline auto KeyOf(const LineCovariance& covariance) {
  return std::tuple(covariance.line_id, covariance.piece);
}
inline auto KeyOf(const LineSupport& support) {
  return std::tuple(support.line_id, support.piece, support.stamp_ns, support.camera);
}

struct LineEvidence {
  std::vector<LineCovariance> covariances;
  std::vector<LineSupport> supports;
};

}  // namespace slcmap
