// Ways in which the axes of an IMU are mixed up, to be tried one after the other.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace slcmap {

// A change of axes P: what should have been read is P times what was read.
struct AxisChange {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  std::string words;  // such as "x negated"; "" where nothing is changed

  bool IsNone() const { return words.empty(); }
  bool IsRotation() const { return matrix.determinant() > 0; }
};

// All 48 changes of order and sign, the plainest first: none, one axis negated, all negated, two
// swapped, and then the rest.
const std::vector<AxisChange>& AxisChanges();

}  // namespace slcmap
