// Control points as terms of an adjustment: where somebody measured points that keyframes see.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mapping/adjustment/adjustment_state.h"
#include "odometry/factors/factor.h"

namespace slcmap::inline mapping {

// A landmark of the run, and where it was measured to be, in the run's world but for a common small
// turn about z and a shift, which are estimated. Metres.
struct ControlTie {
  int64_t landmark_id = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();
};

// The shift s and the turn psi about z that all ties share.
inline constexpr int kControlShiftSize = 4;
inline constexpr BlockKind kControlShiftKind{kControlShiftSize, kControlShiftSize};

// Blocks: pose of the point's host (R, p), shift, point (x, y, lambda). With the point in the
// world, P = R (R_IC (x, y, 1) / lambda + p_IC) + p, and where it was measured, C:
//
//   r = ( Rz(psi) P + s - C ) / sigma
//
// Three rows.
class MeasuredPointResidual final : public Factor {
 public:
  MeasuredPointResidual(const RigidTransform& T_imu_camera, const ControlTie& tie)
      : Factor(3, {kPoseKind, kControlShiftKind, kPointKind}),
        T_imu_camera_(T_imu_camera),
        p_measured_(tie.p_world),
        weights_(tie.sigma_m.cwiseInverse()) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const RigidTransform T_imu_camera_;
  const Eigen::Vector3d p_measured_, weights_;
};

// Those of the ties whose landmarks the state has. One that is wrong by much pulls little.
void AddControlTerms(const std::vector<ControlTie>& ties, const AdjustmentState& state,
                     ceres::LossFunction* loss, ceres::Problem* problem);

}  // namespace slcmap::mapping
