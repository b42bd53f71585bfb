// How a general line block is perturbed.
#pragma once

#include <ceres/manifold.h>

#include "odometry/geometry/general_line.h"

namespace slcmap {

class OrthonormalLineManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kGeneralLineSize; }
  int TangentSize() const override { return kGeneralLineTangentSize; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace slcmap
