#include "odometry/residuals/along_slope_residual.h"

#include <cmath>

#include "odometry/geometry/general_line.h"

namespace slcmap {

using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;

AlongSlopeResidual::AlongSlopeResidual(double sigma_rad)
    : Factor(2, {kSlopeKind, kGeneralLineKind}), weight_(1.0 / sigma_rad) {}

void AlongSlopeResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                    double** jacobians) const {
  const double* slope = parameters[0];
  const Matrix32d across = AxesAcrossSlope(slope);
  const Vector3d direction = GeneralLineFromBlock(Vector3d::Zero(), parameters[1]).direction_world;
  Map<Vector2d>{residuals} = weight_ * across.transpose() * direction;
  if (!jacobians) return;
  if (jacobians[0]) {
    // A turn about the vertical moves both axes, a change of elevation the upright one.
    const Vector3d along = SlopeDirection(slope), up = Vector3d::UnitZ();
    Eigen::Matrix<double, 2, kSlopeSize, Eigen::RowMajor> by_slope;
    by_slope << up.cross(across.col(0)).dot(direction), 0, up.cross(across.col(1)).dot(direction),
        -along.dot(direction);
    Map<Eigen::Matrix<double, 2, kSlopeSize, Eigen::RowMajor>>{jacobians[0]} = weight_ * by_slope;
  }
  if (jacobians[1]) {
    Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>>{jacobians[1]} =
        weight_ * across.transpose() * GeneralLineTurn(parameters[1]);
  }
}

}  // namespace slcmap
