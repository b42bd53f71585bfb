// The reprojection term of a line along an axis of a Manhattan world.
#pragma once

#include "odometry/geometry/structural_line.h"
#include "odometry/residuals/factor.h"
#include "odometry/residuals/line_reprojection.h"

namespace slcmap {

// Blocks: pose, camera calibration (where it is bound), heading (but for a vertical line),
// structural line. Rows as in EvaluateLineReprojection().
class StructuralLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  StructuralLineResidual(const StereoGeometry* geometry, const StructuralLine& line,
                         const StereoLineMeasurement& measurement, bool binds_cameras = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  StructuralLine line_;
  StereoLineMeasurement measurement_;
  bool binds_cameras_;
};

}  // namespace slcmap
