// The terms that tie the directions of lines to an axis of a Manhattan world.
#pragma once

#include "data/types.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// Blocks: heading (but for a vertical line), shared deviation (where it has one), general line.
// With the axes E across the line's own (see structural_line.h), the line's unit direction d and
// the shared deviation c, two angles in rad,
//
//   r = (E^T d - c) / sigma
//
// Two rows. No building is exact: the deviation of a line from its axis is the same in all views of
// it, so it stands in the line's state and not in the noise of what is measured. Towards a sigma of
// zero the line is a structural one, towards a large one it is free. Walls lean and turn as a
// whole, and rooms with them: what lines share with their neighbours does not average out over
// these, and is a state of its own.
class AlongAxisResidual final : public Factor {
 public:
  // The axis is not kNone; sigma_rad is positive.
  AlongAxisResidual(LineAxis axis, double sigma_rad, bool shares = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  LineAxis axis_;
  bool shares_;
  double weight_;
};

// Block: shared deviation c. r = c / sigma, two rows.
class SharedDeviationResidual final : public Factor {
 public:
  explicit SharedDeviationResidual(double sigma_rad);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace slcmap
