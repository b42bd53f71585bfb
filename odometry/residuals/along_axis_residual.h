// The term that ties the direction of a line to an axis of a Manhattan world.
#pragma once

#include "data/types.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// Blocks: heading, general line; for a vertical line: general line. With the axes E across the
// line's own (see structural_line.h) and the line's unit direction d,
//
//   r = E^T d / sigma
//
// Two rows. No building is exact: the deviation of a line from its axis is the same in all views of
// it, so it stands in the line's state and not in the noise of what is measured. Towards a sigma of
// zero the line is a structural one, towards a large one it is free.
class AlongAxisResidual final : public Factor {
 public:
  // The axis is not kNone; sigma_rad is positive.
  AlongAxisResidual(LineAxis axis, double sigma_rad);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  LineAxis axis_;
  double weight_;
};

}  // namespace slcmap
