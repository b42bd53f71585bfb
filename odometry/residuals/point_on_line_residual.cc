#include "odometry/residuals/point_on_line_residual.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAtInfinityResidual = 10;  // standard deviations

}  // namespace

PointOnLineResidual::PointOnLineResidual(const StereoGeometry* geometry, const StructuralLine& line,
                                         double sigma_m)
    : Factor(2, line.HasHeading()
                    ? std::initializer_list<BlockKind>{kPoseKind, kHeadingKind, kStructuralLineKind,
                                                       kPointKind}
                    : std::initializer_list<BlockKind>{kPoseKind, kStructuralLineKind, kPointKind}),
      geometry_(geometry),
      line_(line),
      weight_(1.0 / sigma_m) {}

void PointOnLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                     double** jacobians) const {
  const int line_at = blocks() - 2, point_at = blocks() - 1;
  const double* line = parameters[line_at];
  const double* point = parameters[point_at];
  if (std::min(line[1], point[2]) < 1.0 / kMaxDistance_m) {
    Map<Vector2d>{residuals}.setConstant(kAtInfinityResidual);
    for (int k = 0; jacobians && k < blocks(); ++k) {
      if (jacobians[k]) std::fill_n(jacobians[k], rows() * tangent_size(k), 0.0);
    }
    return;
  }
  const Matrix3d r_h = Map<const Eigen::Quaterniond>(parameters[0] + 3).toRotationMatrix();
  const Matrix3d& r_ic = geometry_->R_imu_camera[0];
  const Vector3d in_camera = Vector3d(point[0], point[1], 1) / point[2];
  const Vector3d in_imu = r_ic * in_camera + geometry_->T_imu_camera[0].translation;
  const Vector3d from_anchor =
      r_h * in_imu + Map<const Vector3d>(parameters[0]) - line_.anchor_world;
  const Matrix32d across = AxesAcross(line_.axis, line_.HasHeading() ? *parameters[1] : 0);
  const Vector2d at_angle(std::cos(line[0]), std::sin(line[0]));
  Map<Vector2d>{residuals} = weight_ * (at_angle / line[1] - across.transpose() * from_anchor);
  if (!jacobians) return;

  using Matrix23d = Eigen::Matrix<double, 2, 3>;
  const Matrix23d by_world = -weight_ * across.transpose();
  const Matrix23d by_host = by_world * r_h;
  if (jacobians[0]) {
    Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> d(jacobians[0]);
    d.leftCols<3>() = by_world;
    d.rightCols<3>() = -by_host * Skew(in_imu);
  }
  if (line_.HasHeading() && jacobians[1]) {
    Map<Vector2d>{jacobians[1]} = -by_world * Vector3d::UnitZ().cross(from_anchor);
  }
  if (jacobians[line_at]) {
    Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> d(jacobians[line_at]);
    d << -at_angle.y(), -at_angle.x() / line[1], at_angle.x(), -at_angle.y() / line[1];
    d *= weight_ / line[1];
  }
  if (jacobians[point_at]) {
    Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> d(jacobians[point_at]);
    const Matrix23d by_camera = by_host * r_ic / point[2];
    d.leftCols<2>() = by_camera.leftCols<2>();
    d.rightCols<1>() = -by_camera * in_camera;
  }
}

}  // namespace slcmap
