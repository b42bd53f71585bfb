#include "odometry/factors/line_constraints.h"

#include <algorithm>
#include <cmath>

#include "odometry/geometry/lines.h"

namespace slcmap::inline odometry {

using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

std::vector<BlockKind> CollectKinds(LineAxis axis, bool shares) {
  std::vector<BlockKind> kinds;
  if (axis != LineAxis::kVertical) kinds.push_back(kHeadingKind);
  if (shares) kinds.push_back(kSharedDeviationKind);
  kinds.push_back(kGeneralLineKind);
  return kinds;
}

}  // namespace

AlongAxisResidual::AlongAxisResidual(LineAxis axis, double sigma_rad, bool shares)
    : Factor(2, CollectKinds(axis, shares)),
      axis_(axis),
      shares_(shares),
      weight_(1.0 / sigma_rad) {}

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

namespace {

using Eigen::Matrix3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kAtInfinityResidual = 10;  // standard deviations

// A point by its host's pose and its block.
struct HostedPoint {
  HostedPoint(const StereoGeometry& geometry, int camera, const double* pose, const double* block)
      : R_world_imu(Map<const Eigen::Quaterniond>(pose + 3).toRotationMatrix()),
        R_imu_camera(geometry.R_imu_camera[camera]),
        inverse_depth_per_m(block[2]),
        p_camera(Vector3d(block[0], block[1], 1) / block[2]),
        p_imu(R_imu_camera * p_camera + geometry.T_imu_camera[camera].translation),
        p_world(R_world_imu * p_imu + Map<const Vector3d>(pose)) {}

  // Derivatives of a residual by pose and point, from that by the place in the world; each may be
  // null.
  void Jacobians(const Matrix23d& by_world, double* by_pose, double* by_point) const {
    const Matrix23d by_imu = by_world * R_world_imu;
    if (by_pose) {
      Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> d(by_pose);
      d.leftCols<3>() = by_world;
      d.rightCols<3>() = -by_imu * Skew(p_imu);
    }
    if (by_point) {
      Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> d(by_point);
      const Matrix23d by_camera = by_imu * R_imu_camera / inverse_depth_per_m;
      d.leftCols<2>() = by_camera.leftCols<2>();
      d.rightCols<1>() = -by_camera * p_camera;
    }
  }

  Matrix3d R_world_imu;
  const Matrix3d& R_imu_camera;
  double inverse_depth_per_m;
  Vector3d p_camera, p_imu, p_world;
};

// The rows of what lies behind the camera or at infinity.
void SetAtInfinity(const Factor& factor, double* residuals, double** jacobians) {
  Map<Vector2d>{residuals}.setConstant(kAtInfinityResidual);
  for (int k = 0; jacobians && k < factor.blocks(); ++k) {
    if (jacobians[k]) std::fill_n(jacobians[k], factor.rows() * factor.tangent_size(k), 0.0);
  }
}

}  // namespace

PointOnLineResidual::PointOnLineResidual(const StereoGeometry* geometry, const StructuralLine& line,
                                         double sigma_m, int host_camera)
    : Factor(2,
             line.HasHeading()
                 ? std::vector<BlockKind>{kPoseKind, kHeadingKind, kStructuralLineKind, kPointKind}
                 : std::vector<BlockKind>{kPoseKind, kStructuralLineKind, kPointKind}),
      geometry_(geometry),
      line_(line),
      weight_(1.0 / sigma_m),
      host_camera_(host_camera) {}

void PointOnLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                     double** jacobians) const {
  const int line_at = blocks() - 2, point_at = blocks() - 1;
  const double* line = parameters[line_at];
  if (std::min(line[1], parameters[point_at][2]) < 1.0 / kMaxDistance_m) {
    SetAtInfinity(*this, residuals, jacobians);
    return;
  }
  const HostedPoint point(*geometry_, host_camera_, parameters[0], parameters[point_at]);
  const Vector3d from_anchor = point.p_world - line_.anchor_world;
  const Matrix32d across = AxesAcross(line_.axis, line_.HasHeading() ? *parameters[1] : 0);
  const Vector2d at_angle(std::cos(line[0]), std::sin(line[0]));
  Map<Vector2d>{residuals} = weight_ * (at_angle / line[1] - across.transpose() * from_anchor);
  if (!jacobians) return;

  const Matrix23d by_world = -weight_ * across.transpose();
  point.Jacobians(by_world, jacobians[0], jacobians[point_at]);
  if (line_.HasHeading() && jacobians[1]) {
    Map<Vector2d>{jacobians[1]} = -by_world * Vector3d::UnitZ().cross(from_anchor);
  }
  if (jacobians[line_at]) {
    Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> d(jacobians[line_at]);
    d << -at_angle.y(), -at_angle.x() / line[1], at_angle.x(), -at_angle.y() / line[1];
    d *= weight_ / line[1];
  }
}

PointOnFreeLineResidual::PointOnFreeLineResidual(const StereoGeometry* geometry,
                                                 const Vector3d& anchor_world, double sigma_m,
                                                 int host_camera)
    : Factor(2, {kPoseKind, kGeneralLineKind, kPointKind}),
      geometry_(geometry),
      anchor_world_(anchor_world),
      weight_(1.0 / sigma_m),
      host_camera_(host_camera) {}

void PointOnFreeLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                         double** jacobians) const {
  const Matrix3d u = Map<const Eigen::Quaterniond>(parameters[1]).toRotationMatrix();
  const double c = std::cos(parameters[1][4]), s = std::sin(parameters[1][4]);
  if (s < std::abs(c) / PointOnLineResidual::kMaxDistance_m ||
      parameters[2][2] < 1.0 / PointOnLineResidual::kMaxDistance_m) {
    SetAtInfinity(*this, residuals, jacobians);
    return;
  }
  const HostedPoint point(*geometry_, host_camera_, parameters[0], parameters[2]);
  const Vector3d q = u.transpose() * (point.p_world - anchor_world_);
  Map<Vector2d>{residuals} = weight_ * Vector2d(q[0], q[2] + c / s);
  if (!jacobians) return;

  Matrix23d by_world;
  by_world << u.col(0).transpose(), u.col(2).transpose();
  point.Jacobians(weight_ * by_world, jacobians[0], jacobians[2]);
  if (jacobians[1]) {
    // U <- U Exp(d) turns q by -d x q.
    Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> d(jacobians[1]);
    d << 0, -q[2], q[1], 0, -q[1], q[0], 0, -1 / (s * s);
    d *= weight_;
  }
}

}  // namespace slcmap::odometry
