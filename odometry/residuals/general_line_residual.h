// The reprojection term of a line of any direction.
#pragma once

#include "odometry/geometry/general_line.h"
#include "odometry/residuals/factor.h"
#include "odometry/residuals/line_reprojection.h"

namespace slcmap {

// Blocks: pose, camera calibration (where it is bound), general line. Rows as in
// EvaluateLineReprojection().
class GeneralLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  GeneralLineResidual(const StereoGeometry* geometry, const Eigen::Vector3d& anchor_world,
                      const StereoLineMeasurement& measurement, bool binds_cameras = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  Eigen::Vector3d anchor_world_;
  StereoLineMeasurement measurement_;
};

}  // namespace slcmap
