#include "odometry/residuals/along_axis_residual.h"

#include "odometry/geometry/general_line.h"
#include "odometry/geometry/structural_line.h"

namespace slcmap {

using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

std::vector<BlockKind> KindsOf(LineAxis axis, bool shares) {
  std::vector<BlockKind> kinds;
  if (axis != LineAxis::kVertical) kinds.push_back(kHeadingKind);
  if (shares) kinds.push_back(kSharedDeviationKind);
  kinds.push_back(kGeneralLineKind);
  return kinds;
}

}  // namespace

AlongAxisResidual::AlongAxisResidual(LineAxis axis, double sigma_rad, bool shares)
    : Factor(2, KindsOf(axis, shares)), axis_(axis), shares_(shares), weight_(1.0 / sigma_rad) {}

void AlongAxisResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  const bool has_heading = axis_ != LineAxis::kVertical;
  const int last = blocks() - 1;
  const Matrix32d across = AxesAcross(axis_, has_heading ? *parameters[0] : 0);
  const Vector3d direction =
      GeneralLineFromBlock(Vector3d::Zero(), parameters[last]).direction_world;
  Vector2d off = across.transpose() * direction;
  if (shares_) off -= Map<const Vector2d>(parameters[last - 1]);
  Map<Vector2d>{residuals} = weight_ * off;
  if (!jacobians) return;
  if (has_heading && jacobians[0]) {
    const Vector3d turned = Vector3d::UnitZ().cross(across.col(0));
    Map<Vector2d>{jacobians[0]} = Vector2d(weight_ * turned.dot(direction), 0);
  }
  if (shares_ && jacobians[last - 1]) {
    Map<Eigen::Matrix2d>{jacobians[last - 1]} = -weight_ * Eigen::Matrix2d::Identity();
  }
  if (jacobians[last]) {
    Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>>{jacobians[last]} =
        weight_ * across.transpose() * GeneralLineTurn(parameters[last]);
  }
}

SharedDeviationResidual::SharedDeviationResidual(double sigma_rad)
    : Factor(2, {kSharedDeviationKind}), weight_(1.0 / sigma_rad) {}

void SharedDeviationResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                         double** jacobians) const {
  Map<Vector2d>{residuals} = weight_ * Map<const Vector2d>(parameters[0]);
  if (jacobians && jacobians[0]) {
    Map<Eigen::Matrix2d>{jacobians[0]} = weight_ * Eigen::Matrix2d::Identity();
  }
}

}  // namespace slcmap
