// The term that ties the direction of a line to a slope that it shares with others.
#pragma once

#include "odometry/geometry/slope.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// Blocks: slope, general line. As AlongAxisResidual, with the axes E across the slope and the
// line's unit direction d:
//
//   r = E^T d / sigma
class AlongSlopeResidual final : public Factor {
 public:
  // sigma_rad is positive.
  explicit AlongSlopeResidual(double sigma_rad);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace slcmap
