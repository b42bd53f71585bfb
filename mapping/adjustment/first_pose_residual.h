// The term that holds what no measurement tells: position and heading of a first pose.
#pragma once

#include "odometry/residuals/factor.h"

namespace slcmap {

// Block: pose. With the given pose (R_0, p_0), rows
//
//   (p - p_0) / 1 mm      z . Log(R R_0^T) / 0.1 mrad
//
// A solution leaves them at zero, since nothing speaks against them.
class FirstPoseResidual final : public Factor {
 public:
  explicit FirstPoseResidual(const RigidTransform& T_world_imu);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  RigidTransform T_world_imu_;
};

}  // namespace slcmap
