#include "odometry/residuals/general_line_residual.h"

#include <cmath>

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The line in Pluecker coordinates and, where wanted, its derivatives by the block's tangent.
PlueckerLine Pluecker(const Vector3d& anchor_world, const double* block,
                      PlueckerJacobian* jacobian) {
  const Matrix3d u = Eigen::Map<const Eigen::Quaterniond>(block).toRotationMatrix();
  const double c = std::cos(block[4]), s = std::sin(block[4]);
  if (jacobian) {
    // U <- U Exp(d): u_k changes by u_j d_i - u_i d_j for the cyclic (i, j, k).
    const Vector3d zero = Vector3d::Zero();
    jacobian->moment.resize(3, 4);
    jacobian->direction.resize(3, 4);
    jacobian->moment << zero, -c * u.col(2), c * u.col(1), -s * u.col(0);
    jacobian->direction << s * u.col(2), zero, -s * u.col(0), c * u.col(1);
  }
  return {anchor_world, c * u.col(0), s * u.col(1)};
}

}  // namespace

GeneralLineResidual::GeneralLineResidual(const StereoGeometry* geometry,
                                         const Vector3d& anchor_world,
                                         const StereoLineMeasurement& measurement,
                                         bool binds_cameras)
    : Factor(measurement.rows(),
             binds_cameras
                 ? std::vector<BlockKind>{kPoseKind, kCameraCalibrationKind, kGeneralLineKind}
                 : std::vector<BlockKind>{kPoseKind, kGeneralLineKind}),
      geometry_(geometry),
      anchor_world_(anchor_world),
      measurement_(measurement) {}

void GeneralLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                     double** jacobians) const {
  const int last = blocks() - 1;
  const double* cameras = last == 2 ? parameters[1] : nullptr;
  if (!jacobians) {
    EvaluateLineReprojection(*geometry_, measurement_, parameters[0], cameras,
                             Pluecker(anchor_world_, parameters[last], nullptr), residuals);
    return;
  }
  PlueckerJacobian by_tangent;
  const PlueckerLine line = Pluecker(anchor_world_, parameters[last], &by_tangent);
  LineReprojectionJacobian d;
  LinearizeLineReprojection(*geometry_, measurement_, parameters[0], cameras, line, by_tangent,
                            residuals, &d);
  using RowMajor6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using ByCameras = Eigen::Matrix<double, Eigen::Dynamic, kCameraCalibrationSize, Eigen::RowMajor>;
  using RowMajor4 = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;
  if (jacobians[0]) Eigen::Map<RowMajor6>(jacobians[0], rows(), 6) = d.by_pose;
  if (cameras && jacobians[1]) {
    Eigen::Map<ByCameras>(jacobians[1], rows(), kCameraCalibrationSize) = d.by_cameras;
  }
  if (jacobians[last]) Eigen::Map<RowMajor4>(jacobians[last], rows(), 4) = d.by_line;
}

}  // namespace slcmap
