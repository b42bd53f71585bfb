#include "apps/evaluation/alignment.h"

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap {
namespace {

// Minimises sum |truth - Rz(yaw) estimate - t|^2: with both sets centred, the sum falls with
// cos(yaw) * sum(xe xt + ye yt) + sin(yaw) * sum(xe yt - ye xt).
Alignment AlignPositionYaw(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth) {
  const Eigen::Vector3d mean_estimate = estimate.rowwise().mean(),
                        mean_truth = truth.rowwise().mean();
  const Eigen::Matrix3Xd e = estimate.colwise() - mean_estimate, t = truth.colwise() - mean_truth;
  const double along = e.row(0).dot(t.row(0)) + e.row(1).dot(t.row(1));
  const double across = e.row(0).dot(t.row(1)) - e.row(1).dot(t.row(0));
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(std::atan2(across, along), Eigen::Vector3d::UnitZ()));
  return {1, {rotation, mean_truth - rotation * mean_estimate}};
}

Alignment AlignUmeyama(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth,
                       bool with_scale) {
  // Without any extent there is no scale to find.
  with_scale = with_scale && (estimate.colwise() - estimate.col(0)).norm() > 1e-9;
  const Eigen::Matrix4d matrix = Eigen::umeyama(estimate, truth, with_scale);
  const double scale = with_scale ? std::cbrt(matrix.topLeftCorner<3, 3>().determinant()) : 1;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>() / scale;
  return {scale, {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()}};
}

}  // namespace

std::string AlignmentName(AlignmentKind kind) {
  switch (kind) {
    case AlignmentKind::kPositionYaw:
      return "posyaw";
    case AlignmentKind::kRigid:
      return "se3";
    case AlignmentKind::kSimilarity:
      break;
  }
  return "sim3";
}

Alignment Align(AlignmentKind kind, const Eigen::Matrix3Xd& estimate,
                const Eigen::Matrix3Xd& truth) {
  if (kind == AlignmentKind::kPositionYaw) return AlignPositionYaw(estimate, truth);
  return AlignUmeyama(estimate, truth, kind == AlignmentKind::kSimilarity);
}

}  // namespace slcmap
