#include "mapping/adjustment/first_pose_residual.h"

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kWeight_m = 1e3, kWeight_rad = 1e4;

}  // namespace

FirstPoseResidual::FirstPoseResidual(const RigidTransform& T_world_imu)
    : Factor(4, {kPoseKind}), T_world_imu_(T_world_imu) {}

void FirstPoseResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  const Map<const Quaterniond> q(parameters[0] + 3);
  const Vector3d turned = LogRotation(q * T_world_imu_.rotation.conjugate());
  Map<Eigen::Vector4d>{residuals} << kWeight_m * (Map<const Vector3d>(parameters[0]) -
                                                  T_world_imu_.translation),
      kWeight_rad * turned.z();
  if (!jacobians || !jacobians[0]) return;
  Map<Eigen::Matrix<double, 4, kPoseTangentSize, Eigen::RowMajor>> by_pose(jacobians[0]);
  by_pose.setZero();
  by_pose.topLeftCorner<3, 3>().diagonal().setConstant(kWeight_m);
  // R Exp(d) R_0^T = Exp(turned) Exp(R_0 d)
  by_pose.bottomRightCorner<1, 3>() =
      kWeight_rad *
      (RightJacobianInverse(turned) * T_world_imu_.rotation.toRotationMatrix()).row(2);
}

}  // namespace slcmap
