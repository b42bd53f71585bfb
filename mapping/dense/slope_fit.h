// The slopes of inverse depth (or disparity) around a place, by least squares.
#pragma once

#include <Eigen/Dense>
#include <optional>

namespace slcmap {

// Fits value = c + a x + b y to weighted samples.
class SlopeFit {
 public:
  void Add(double x, double y, double value, double weight = 1) {
    const Eigen::Vector3d row(1, x, y);
    normal_ += weight * row * row.transpose();
    right_ += weight * value * row;
    ++count_;
  }
  int count() const { return count_; }

  // (c, a, b); nothing where the samples lie on a line.
  std::optional<Eigen::Vector3d> Solve() const {
    const Eigen::LDLT<Eigen::Matrix3d> factors(normal_);
    const Eigen::Vector3d pivots = factors.vectorD();
    if (count_ < 3 || pivots.minCoeff() <= 1e-9 * pivots.maxCoeff()) return std::nullopt;
    return factors.solve(right_);
  }

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

}  // namespace slcmap
