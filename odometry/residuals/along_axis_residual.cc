#include "odometry/residuals/along_axis_residual.h"

#include "odometry/geometry/general_line.h"
#include "odometry/geometry/structural_line.h"

namespace slcmap {

using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;

AlongAxisResidual::AlongAxisResidual(LineAxis axis, double sigma_rad)
    : Factor(2, axis == LineAxis::kVertical
                    ? std::vector<BlockKind>{kGeneralLineKind}
                    : std::vector<BlockKind>{kHeadingKind, kGeneralLineKind}),
      axis_(axis),
      weight_(1.0 / sigma_rad) {}

void AlongAxisResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  const int last = blocks() - 1;
  const Matrix32d across = AxesAcross(axis_, last > 0 ? *parameters[0] : 0);
  const Vector3d direction =
      GeneralLineFromBlock(Vector3d::Zero(), parameters[last]).direction_world;
  Map<Vector2d>{residuals} = weight_ * across.transpose() * direction;
  if (!jacobians) return;
  if (last > 0 && jacobians[0]) {
    const Vector3d turned = Vector3d::UnitZ().cross(across.col(0));
    Map<Vector2d>{jacobians[0]} = Vector2d(weight_ * turned.dot(direction), 0);
  }
  if (jacobians[last]) {
    Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>>{jacobians[last]} =
        weight_ * across.transpose() * GeneralLineTurn(parameters[last]);
  }
}

}  // namespace slcmap
