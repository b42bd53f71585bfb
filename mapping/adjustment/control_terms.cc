#include "mapping/adjustment/control_terms.h"

#include <algorithm>
#include <cmath>

namespace slcmap::inline mapping {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void MeasuredPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                       double** jacobians) const {
  const RigidTransform T_world_imu = PoseFromBlock(parameters[0]);
  const double* point = parameters[2];
  const Vector3d p_camera = Vector3d(point[0], point[1], 1) / point[2];
  const Vector3d p_imu = T_imu_camera_ * p_camera, p_world = T_world_imu * p_imu;
  const Matrix3d turn = Eigen::AngleAxisd(parameters[1][3], Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d turned = turn * p_world;
  Map<Vector3d>{residuals} =
      weights_.cwiseProduct(turned + Map<const Vector3d>(parameters[1]) - p_measured_);
  if (!jacobians) return;
  const Matrix3d by_world = weights_.asDiagonal() * turn;
  const Matrix3d R_world_imu = T_world_imu.rotation.toRotationMatrix();
  if (jacobians[0]) {
    Map<Eigen::Matrix<double, 3, kPoseTangentSize, Eigen::RowMajor>> by_pose(jacobians[0]);
    by_pose.leftCols<3>() = by_world;
    by_pose.rightCols<3>() = -by_world * R_world_imu * Skew(p_imu);
  }
  if (jacobians[1]) {
    Map<Eigen::Matrix<double, 3, kControlShiftSize, Eigen::RowMajor>> by_shift(jacobians[1]);
    by_shift.leftCols<3>() = weights_.asDiagonal();
    by_shift.rightCols<1>() = weights_.cwiseProduct(Vector3d::UnitZ().cross(turned));
  }
  if (jacobians[2]) {
    Matrix3d by_point = Matrix3d::Identity() / point[2];
    by_point.col(2) = -p_camera / point[2];
    Map<Eigen::Matrix<double, 3, kPointSize, Eigen::RowMajor>>{jacobians[2]} =
        by_world * R_world_imu * T_imu_camera_.rotation.toRotationMatrix() * by_point;
  }
}

void AddControlTerms(const std::vector<ControlTie>& ties, const AdjustmentState& state,
                     ceres::LossFunction* loss, ceres::Problem* problem) {
  for (const ControlTie& tie : ties) {
    const auto point = std::ranges::find_if(state.points, [&](const AdjustedPoint& p) {
      return p.landmark->id == tie.landmark_id && !p.observations.empty();
    });
    if (point == state.points.end()) continue;
    problem->AddResidualBlock(new MeasuredPointResidual(state.rig.T_imu_camera[0], tie), loss,
                              {state.frames[point->host].pose, state.control_shift, point->block});
  }
}

}  // namespace slcmap::mapping
