#include "odometry/residuals/structural_line_residual.h"

#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The line in Pluecker coordinates, scaled by rho so that one at infinity is nothing special. Where
// wanted, its derivatives by (heading, theta, rho). The heading is null for vertical lines.
PlueckerLine Pluecker(const StructuralLine& line, const double* heading, const double* block,
                      PlueckerJacobian* jacobian) {
  const double heading_rad = heading ? *heading : 0;
  const Vector3d axis = AxisDirection(line.axis, heading_rad);
  const Matrix32d across = AxesAcross(line.axis, heading_rad);
  const double c = std::cos(block[0]), s = std::sin(block[0]), rho = block[1];
  const PlueckerLine out{line.anchor_world, (across * Vector2d(c, s)).cross(axis), rho * axis};
  if (jacobian) {
    const Vector3d up = Vector3d::UnitZ();
    jacobian->moment.resize(3, 3);
    jacobian->direction.resize(3, 3);
    if (line.HasHeading()) {
      jacobian->moment.col(0) = up.cross(out.moment);
      jacobian->direction.col(0) = up.cross(out.direction);
    } else {
      jacobian->moment.col(0).setZero();
      jacobian->direction.col(0).setZero();
    }
    jacobian->moment.col(1) = (across * Vector2d(-s, c)).cross(axis);
    jacobian->direction.col(1).setZero();
    jacobian->moment.col(2).setZero();
    jacobian->direction.col(2) = axis;
  }
  return out;
}

std::vector<BlockKind> KindsOf(const StructuralLine& line, bool binds_cameras) {
  std::vector<BlockKind> kinds{kPoseKind};
  if (binds_cameras) kinds.push_back(kCameraCalibrationKind);
  if (line.HasHeading()) kinds.push_back(kHeadingKind);
  kinds.push_back(kStructuralLineKind);
  return kinds;
}

}  // namespace

StructuralLineResidual::StructuralLineResidual(const StereoGeometry* geometry,
                                               const StructuralLine& line,
                                               const StereoLineMeasurement& measurement,
                                               bool binds_cameras)
    : Factor(measurement.rows(), KindsOf(line, binds_cameras)),
      geometry_(geometry),
      line_(line),
      measurement_(measurement),
      binds_cameras_(binds_cameras) {}

void StructuralLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                        double** jacobians) const {
  const int last = blocks() - 1, heading_at = last - 1;
  const double* cameras = binds_cameras_ ? parameters[1] : nullptr;
  const double* heading = line_.HasHeading() ? parameters[heading_at] : nullptr;
  if (!jacobians) {
    EvaluateLineReprojection(*geometry_, measurement_, parameters[0], cameras,
                             Pluecker(line_, heading, parameters[last], nullptr), residuals);
    return;
  }
  PlueckerJacobian by_parameters;
  const PlueckerLine line = Pluecker(line_, heading, parameters[last], &by_parameters);
  LineReprojectionJacobian d;
  LinearizeLineReprojection(*geometry_, measurement_, parameters[0], cameras, line, by_parameters,
                            residuals, &d);
  using RowMajor6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
  using ByCameras = Eigen::Matrix<double, Eigen::Dynamic, kCameraCalibrationSize, Eigen::RowMajor>;
  using RowMajor2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
  if (jacobians[0]) Eigen::Map<RowMajor6>(jacobians[0], rows(), 6) = d.by_pose;
  if (cameras && jacobians[1]) {
    Eigen::Map<ByCameras>(jacobians[1], rows(), kCameraCalibrationSize) = d.by_cameras;
  }
  if (heading && jacobians[heading_at]) {
    Eigen::Map<Eigen::VectorXd>(jacobians[heading_at], rows()) = d.by_line.col(0);
  }
  if (jacobians[last]) {
    Eigen::Map<RowMajor2>(jacobians[last], rows(), 2) = d.by_line.rightCols<2>();
  }
}

}  // namespace slcmap
