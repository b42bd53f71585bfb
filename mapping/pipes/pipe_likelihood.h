// How much likelier outlines in images and a dense cloud are of a pipe than of anything else that
// is straight: of fixed edges, of a strip on a surface, of a bar.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/core/math.h"
#include "mapping/map/map.h"
#include "mapping/map/point_index.h"
#include "mapping/pipes/outlines.h"

namespace slcmap::inline mapping {

struct Cylinder {
  PointAndDirection axis;
  double radius_m = 0;
};

struct PipeFit {
  Cylinder cylinder;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of the axis across it (m2), the radius
  int images = 0, both_images = 0;  // that show an outline, and that show one on each side

  double sigma_m() const;  // of the axis, where that is largest
  double radius_sigma_m() const;
};

// The cylinder that the outlines are tangent to, by linear least squares with Cauchy's loss; its
// direction is that of `start`, which also tells on which side of it each passes. Nothing where
// they are not of a cylinder.
std::optional<PipeFit> FitPipe(const PointAndDirection& start,
                               const std::vector<const Outline*>& outlines);

// The share of an outline's sights that touch a cylinder.
double TouchingShare(const Cylinder& cylinder, const Outline& outline);

// A dense cloud, and the index of it; they must outlive this.
struct IndexedCloud {
  const std::vector<DensePoint>& points;
  const PointTree& index;
};

// The logarithm of the likelihood ratio of a pipe, between two places along its axis, and of what
// explains the same outlines and points best that is none. Places and sizes that outlines leave
// open are integrated out (Laplace), so a body of more parameters has to earn them.
double ComputePipeLogRatio(const Cylinder& cylinder, const Interval& interval,
                           const std::vector<const Outline*>& outlines, const IndexedCloud& cloud);

}  // namespace slcmap::mapping
