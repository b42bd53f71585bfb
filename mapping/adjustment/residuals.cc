#include "mapping/adjustment/residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {
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

LineDistanceResidual::LineDistanceResidual(const BlockKind& kind, const double* block, double sigma)
    : Factor(1, {kind}), last_(kind.size - 1), given_(block[last_]), weight_(1 / sigma) {}

void LineDistanceResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                      double** jacobians) const {
  residuals[0] = weight_ * (parameters[0][last_] - given_);
  if (!jacobians || !jacobians[0]) return;
  Eigen::Map<Eigen::RowVectorXd> by_line(jacobians[0], tangent_size(0));
  by_line.setZero();
  by_line[tangent_size(0) - 1] = weight_;
}

namespace {

using Eigen::Vector2d;

using RowMajor22 = Eigen::Matrix<double, 2, 2, Eigen::RowMajor>;
using RowMajor24 = Eigen::Matrix<double, 2, 4, Eigen::RowMajor>;

std::vector<BlockKind> CollectKinds(LineAxis axis) {
  if (axis == LineAxis::kVertical) return {kStructuralLineKind, kStructuralLineKind};
  return {kHeadingKind, kStructuralLineKind, kStructuralLineKind};
}

Vector2d Crossing(const double* block) {
  return Vector2d(std::cos(block[0]), std::sin(block[0])) / block[1];
}

RowMajor22 CrossingByBlock(const double* block) {
  const Vector2d at = Crossing(block);
  RowMajor22 out;
  out << -at.y(), -at.x() / block[1], at.x(), -at.y() / block[1];
  return out;
}

}  // namespace

SameStructuralEdgeResidual::SameStructuralEdgeResidual(LineAxis axis,
                                                       const Vector3d& first_anchor_world,
                                                       const Vector3d& second_anchor_world,
                                                       double sigma_m)
    : Factor(2, CollectKinds(axis)),
      axis_(axis),
      between_anchors_(first_anchor_world - second_anchor_world),
      weight_(1 / sigma_m) {}

void SameStructuralEdgeResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                            double** jacobians) const {
  const bool has_heading = axis_ != LineAxis::kVertical;
  const double heading_rad = has_heading ? *parameters[0] : 0;
  const double* const* lines = parameters + has_heading;
  const Matrix32d across = AxesAcross(axis_, heading_rad);
  Map<Vector2d>{residuals} =
      weight_ * (across.transpose() * between_anchors_ + Crossing(lines[0]) - Crossing(lines[1]));
  if (!jacobians) return;
  if (has_heading && jacobians[0]) {
    // Rz(psi) turns E: d E / d psi = z x E.
    const Vector3d turned = between_anchors_.cross(Vector3d::UnitZ());
    Map<Vector2d>{jacobians[0]} = weight_ * across.transpose() * turned;
  }
  double** by_lines = jacobians + has_heading;
  if (by_lines[0]) Map<RowMajor22>{by_lines[0]} = weight_ * CrossingByBlock(lines[0]);
  if (by_lines[1]) Map<RowMajor22>{by_lines[1]} = -weight_ * CrossingByBlock(lines[1]);
}

SameFreeEdgeResidual::SameFreeEdgeResidual(const End& first, const End& second,
                                           const Matrix32d& across, double sigma_m)
    : Factor(2, {kGeneralLineKind, kGeneralLineKind}),
      ends_{first, second},
      across_(across),
      weight_(1 / sigma_m) {}

void SameFreeEdgeResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                      double** jacobians) const {
  Vector3d between = Vector3d::Zero();
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1 : -1;
    const PointAndDirection line = GeneralLineFromBlock(ends_[i].anchor_world, parameters[i]);
    between += sign * (line.point_world + ends_[i].along_m * line.direction_world);
    if (!jacobians || !jacobians[i]) continue;
    Map<RowMajor24>{jacobians[i]} =
        sign * weight_ * across_.transpose() * GeneralLineShift(parameters[i], ends_[i].along_m);
  }
  Map<Vector2d>{residuals} = weight_ * across_.transpose() * between;
}

namespace {

// A point of its host's left camera, in the world, and how it moves with the pose and with itself.
struct HostedPoint {
  HostedPoint(const RigidTransform& T_world_imu, const RigidTransform& T_imu_camera,
              const double* point) {
    const Vector3d p_camera = Vector3d(point[0], point[1], 1) / point[2];
    const Vector3d p_imu = T_imu_camera * p_camera;
    const Eigen::Matrix3d R_world_imu = T_world_imu.rotation.toRotationMatrix();
    p_world = T_world_imu * p_imu;
    by_pose << Eigen::Matrix3d::Identity(), -R_world_imu * Skew(p_imu);
    by_point = Eigen::Matrix3d::Identity() / point[2];
    by_point.col(2) = -p_camera / point[2];
    by_point = R_world_imu * T_imu_camera.rotation.toRotationMatrix() * by_point;
  }

  Vector3d p_world;
  Eigen::Matrix<double, 3, kPoseTangentSize> by_pose;
  Eigen::Matrix3d by_point;
};

}  // namespace

void MeasuredPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                       double** jacobians) const {
  const HostedPoint point(PoseFromBlock(parameters[0]), T_imu_camera_, parameters[2]);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(parameters[1][3], Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d turned = turn * point.p_world;
  Map<Vector3d>{residuals} =
      weights_.cwiseProduct(turned + Map<const Vector3d>(parameters[1]) - p_measured_);
  if (!jacobians) return;
  const Eigen::Matrix3d by_world = weights_.asDiagonal() * turn;
  if (jacobians[0]) {
    Map<Eigen::Matrix<double, 3, kPoseTangentSize, Eigen::RowMajor>>{jacobians[0]} =
        by_world * point.by_pose;
  }
  if (jacobians[1]) {
    Map<Eigen::Matrix<double, 3, kControlShiftSize, Eigen::RowMajor>> by_shift(jacobians[1]);
    by_shift.leftCols<3>() = weights_.asDiagonal();
    by_shift.rightCols<1>() = weights_.cwiseProduct(Vector3d::UnitZ().cross(turned));
  }
  if (jacobians[2]) {
    Map<Eigen::Matrix<double, 3, kPointSize, Eigen::RowMajor>>{jacobians[2]} =
        by_world * point.by_point;
  }
}

KnownDistanceResidual::KnownDistanceResidual(const RigidTransform& T_imu_camera,
                                             const DistanceTie& tie, bool one_host)
    : Factor(1, one_host ? std::vector<BlockKind>{kPointKind, kPointKind}
                         : std::vector<BlockKind>{kPointKind, kPointKind, kPoseKind, kPoseKind}),
      T_imu_camera_(T_imu_camera),
      metres_(tie.metres),
      weight_(1 / tie.sigma_m),
      one_host_(one_host) {}

void KnownDistanceResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                       double** jacobians) const {
  const auto place = [&](int end) {
    const RigidTransform host = one_host_ ? RigidTransform() : PoseFromBlock(parameters[2 + end]);
    return HostedPoint(host, T_imu_camera_, parameters[end]);
  };
  const HostedPoint first = place(0), second = place(1);
  const Vector3d apart = first.p_world - second.p_world;
  const double length_m = std::max(apart.norm(), std::numeric_limits<double>::min());
  residuals[0] = weight_ * (length_m - metres_);
  if (!jacobians) return;
  const Eigen::RowVector3d along = weight_ / length_m * apart.transpose();
  for (const int end : {0, 1}) {
    const HostedPoint& point = end == 0 ? first : second;
    const double sign = end == 0 ? 1 : -1;
    if (jacobians[end]) {
      Map<Eigen::RowVector3d>{jacobians[end]} = sign * along * point.by_point;
    }
    if (one_host_ || !jacobians[2 + end]) continue;
    Map<Eigen::Matrix<double, 1, kPoseTangentSize>>{jacobians[2 + end]} =
        sign * along * point.by_pose;
  }
}

}  // namespace slcmap::mapping
