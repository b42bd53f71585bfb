// How places in rectified images move with the focal lengths of the cameras behind them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "data/types.h"

namespace slcmap {

// A camera whose focal lengths are longer by the share s than those it is rectified with has the
// direction that was measured at m, on the plane z = 1 of the rectified frame, at
//
//   m - s / (1 + s) g(m)
//
// For an ideal pinhole that looks along z this is m / (1 + s), with g(m) = m. A lens that distorts
// has larger shifts towards the border (by 20 % and more; fisheye by half), and one whose axis is
// not that of the rectified frame has them about its own axis: between two cameras that converge by
// 0.8 degrees, 0.3 % are 0.02 px of disparity.
class FocalShift {
 public:
  FocalShift() = default;  // of the ideal pinhole
  // From a camera as it was given, and the rectified one's orientation and image.
  FocalShift(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
             const Camera& rectified);

  Eigen::Vector2d At(const Eigen::Vector2d& measured) const;          // g
  Eigen::Matrix2d GradientAt(const Eigen::Vector2d& measured) const;  // of g

 private:
  // Four nodes, by the first of them, and where between them, from 0 to 1.
  struct Cell {
    const Eigen::Vector2d* first;
    double x, y;
  };
  Cell CellAt(const Eigen::Vector2d& measured) const;

  // g at the nodes of a grid over the rectified image, row by row; interpolated in between.
  std::vector<Eigen::Vector2d> nodes_;
  Eigen::Vector2d first_ = Eigen::Vector2d::Zero(), per_step_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
};

// Of both cameras of a rig (the right one's where there is one), by the rectified ones.
std::array<FocalShift, 2> FocalShiftsOf(const Rig& given, const Rig& rectified);

}  // namespace slcmap
