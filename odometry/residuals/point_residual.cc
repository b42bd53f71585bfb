#include "odometry/residuals/point_residual.h"

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// A point nearer than this share of its host's distance is about to pass behind the target; it gets
// a constant residual, so that the solver neither fails on it nor gains by it.
constexpr double kMinDepthRatio = 0.02;
constexpr double kBehindResidual = 10;  // standard deviations

struct Projection {
  Vector2d residual = Vector2d::Constant(kBehindResidual);
  Matrix23d jacobian = Matrix23d::Zero();  // d residual / d p_camera
};

Projection Project(const Vector3d& p_camera, const Vector2d& measured, double weight) {
  Projection out;
  if (p_camera.z() < kMinDepthRatio) return out;
  const double inverse_z = 1.0 / p_camera.z();
  const Vector2d on_plane = p_camera.head<2>() * inverse_z;
  out.residual = weight * (on_plane - measured);
  out.jacobian << inverse_z, 0, -on_plane.x() * inverse_z, 0, inverse_z, -on_plane.y() * inverse_z;
  out.jacobian *= weight;
  return out;
}

}  // namespace

StereoGeometry::StereoGeometry(const std::array<RigidTransform, 2>& transforms, double w)
    : T_imu_camera(transforms),
      R_imu_camera{transforms[0].rotation.toRotationMatrix(),
                   transforms[1].rotation.toRotationMatrix()},
      weight(w) {}

PointResidual::PointResidual(const StereoGeometry* geometry, const StereoMeasurement& target)
    : Factor(target.right ? 4 : 2, {kPoseKind, kPoseKind, kPointKind}),
      geometry_(geometry),
      target_(target) {}

void PointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                               double** jacobians) const {
  const Map<const Vector3d> p_h(parameters[0]), p_t(parameters[1]);
  const Matrix3d r_h = Map<const Quaterniond>(parameters[0] + 3).toRotationMatrix();
  const Matrix3d r_t_t = Map<const Quaterniond>(parameters[1] + 3).conjugate().toRotationMatrix();
  const Vector3d ray(parameters[2][0], parameters[2][1], 1);
  const double lambda = parameters[2][2];
  const Matrix3d& r_ic0 = geometry_->R_imu_camera[0];
  const Vector3d in_host = r_ic0 * ray + lambda * geometry_->T_imu_camera[0].translation;
  const Vector3d between = p_h - p_t;
  const Vector3d m = r_t_t * (r_h * in_host + lambda * between);
  const int cameras = target_.right ? 2 : 1;
  for (int c = 0; c < cameras; ++c) {
    const Matrix3d& r_ic = geometry_->R_imu_camera[c];
    const Vector3d& p_ic = geometry_->T_imu_camera[c].translation;
    const Projection projection =
        Project(r_ic.transpose() * (m - lambda * p_ic), c == 0 ? target_.left : *target_.right,
                geometry_->weight);
    Map<Vector2d>{residuals + 2 * c} = projection.residual;
    if (!jacobians) continue;
    const Matrix23d by_m = projection.jacobian * r_ic.transpose();
    const Matrix23d by_world = by_m * r_t_t;
    const Matrix23d by_host = by_world * r_h;
    using Jacobian26 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;
    using Jacobian23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
    if (jacobians[0]) {
      Map<Jacobian26> d(jacobians[0] + 12 * c);
      d.leftCols<3>() = lambda * by_world;
      d.rightCols<3>() = -by_host * Skew(in_host);
    }
    if (jacobians[1]) {
      Map<Jacobian26> d(jacobians[1] + 12 * c);
      d.leftCols<3>() = -lambda * by_world;
      d.rightCols<3>() = by_m * Skew(m);
    }
    if (jacobians[2]) {
      Map<Jacobian23> d(jacobians[2] + 6 * c);
      d.leftCols<2>() = by_host * r_ic0.leftCols<2>();
      d.rightCols<1>() =
          by_host * geometry_->T_imu_camera[0].translation + by_world * between - by_m * p_ic;
    }
  }
}

HostPointResidual::HostPointResidual(const StereoGeometry& geometry, const StereoMeasurement& host)
    : Factor(host.right ? 4 : 2, {kPointKind}),
      weight_(geometry.weight),
      T_right_left_(geometry.T_imu_camera[1].Inverse() * geometry.T_imu_camera[0]),
      host_(host) {}

void HostPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  const Vector3d ray(parameters[0][0], parameters[0][1], 1);
  Map<Vector2d>{residuals} = weight_ * (ray.head<2>() - host_.left);
  using Jacobian23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;
  const bool wanted = jacobians && jacobians[0];
  if (wanted) {
    Map<Jacobian23> d(jacobians[0]);
    d.setZero();
    d(0, 0) = d(1, 1) = weight_;
  }
  if (!host_.right) return;
  const Matrix3d r = T_right_left_.rotation.toRotationMatrix();
  const Projection projection =
      Project(r * ray + parameters[0][2] * T_right_left_.translation, *host_.right, weight_);
  Map<Vector2d>{residuals + 2} = projection.residual;
  if (wanted) {
    Map<Jacobian23> d(jacobians[0] + 6);
    d.leftCols<2>() = projection.jacobian * r.leftCols<2>();
    d.rightCols<1>() = projection.jacobian * T_right_left_.translation;
  }
}

}  // namespace slcmap
