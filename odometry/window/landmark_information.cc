#include "odometry/window/landmark_information.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include "odometry/residuals/block_kind.h"

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of the prior and of the observations in the window, on the tangent of a line's block.
Eigen::MatrixXd InformationOn(const LineLandmark& line, const CostModel& model,
                              const Prior& prior) {
  const int size = line.kind().tangent_size;
  std::vector<FixedTerm> terms;
  for (const FrameState* frame : line.frames) terms.push_back(FixedLineTerm(line, *frame, model));
  Eigen::MatrixXd information = EquationsOnLast(terms, size).information;
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    if (prior.blocks[k] != line.block.data()) continue;
    const auto columns = prior.jacobian.middleCols(prior.TangentOffset(static_cast<int>(k)), size);
    information += columns.transpose() * columns;
  }
  return information;
}

// Where a line crosses the plane through a point that is normal to a direction.
Vector3d CrossingAt(const LineLandmark& line, const Vector3d& p_world, const Vector3d& normal) {
  const PointAndDirection in_world = line.InWorld();
  const double along_m =
      normal.dot(p_world - in_world.point_world) / normal.dot(in_world.direction_world);
  return in_world.point_world + along_m * in_world.direction_world;
}

}  // namespace

Eigen::Vector4d ResidualOf(const FixedTerm& term) {
  Eigen::Vector4d residual = Eigen::Vector4d::Zero();
  term.factor->Evaluate(term.blocks.data(), residual.data(), nullptr);
  return residual;
}

std::pair<double, double> Chi2OfObservation(const FixedTerm& term) {
  const Eigen::Vector4d residual = ResidualOf(term);
  return {residual.head<2>().squaredNorm(), residual.tail<2>().squaredNorm()};
}

BlockEquations EquationsOnLast(const std::vector<FixedTerm>& terms, int tangent_size) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  BlockEquations out;
  out.information = Eigen::MatrixXd::Zero(tangent_size, tangent_size);
  out.gradient = Eigen::VectorXd::Zero(tangent_size);
  for (const FixedTerm& term : terms) {
    const Factor& factor = *term.factor;
    RowMajor jacobian(factor.rows(), tangent_size);
    Eigen::VectorXd residual(factor.rows());
    std::array<double*, Factor::kMaxBlocks> jacobians{};
    jacobians[static_cast<size_t>(factor.blocks() - 1)] = jacobian.data();
    factor.Linearize(term.blocks.data(), residual.data(), jacobians.data());
    out.information += jacobian.transpose() * jacobian;
    out.gradient += jacobian.transpose() * residual;
    out.squared_residuals += residual.squaredNorm();
    out.rows += factor.rows();
  }
  return out;
}

// The block's covariance, brought to the world by central differences.
Matrix3d CovarianceAcross(const LineLandmark& line, const Vector3d& p_world, const CostModel& model,
                          const Prior& prior) {
  constexpr double kStep = 1e-6;
  const Eigen::MatrixXd information = InformationOn(line, model, prior);
  const Eigen::Index size = information.rows();
  const Vector3d direction = line.InWorld().direction_world;
  Eigen::Matrix3Xd by_tangent(3, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    std::array<Vector3d, 2> moved;
    for (int side = 0; side < 2; ++side) {
      Eigen::VectorXd delta = Eigen::VectorXd::Zero(size);
      delta[i] = side == 0 ? -kStep : kStep;
      LineLandmark copy = line;
      BlockPlus(line.kind(), line.block.data(), delta.data(), copy.block.data());
      moved[static_cast<size_t>(side)] = CrossingAt(copy, p_world, direction);
    }
    by_tangent.col(i) = (moved[1] - moved[0]) / (2 * kStep);
  }
  const Eigen::MatrixXd covariance =
      (information + 1e-9 * Eigen::MatrixXd::Identity(size, size)).inverse();
  return by_tangent * covariance * by_tangent.transpose();
}

std::optional<PointPlace> PlaceByObservations(const PointLandmark& point, const CostModel& model) {
  const BlockEquations equations = EquationsOnLast(FixedPointTerms(point, model), kPointSize);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(equations.information);
  const auto pivots = ldlt.vectorD();
  if (!(pivots.minCoeff() > 1e-12 * pivots.maxCoeff())) return std::nullopt;
  const Vector3d step = ldlt.solve(equations.gradient);
  PointLandmark copy = point;
  Eigen::Map<Vector3d>{copy.point.data()} -= step;
  if (!(copy.inverse_depth_per_m() > 0)) return std::nullopt;
  const double depth_m = 1 / copy.inverse_depth_per_m();
  Matrix3d by_point = depth_m * Matrix3d::Identity();
  by_point.col(2) = -depth_m * depth_m * Vector3d(copy.point[0], copy.point[1], 1);
  by_point = (copy.host()->T_world_imu().rotation * model.geometry.T_imu_camera[0].rotation)
                 .toRotationMatrix() *
             by_point;
  const Matrix3d covariance = ldlt.solve(Matrix3d::Identity());
  return PointPlace{
      LandmarkInWorld(copy, model.geometry), by_point * covariance * by_point.transpose(),
      equations.squared_residuals - equations.gradient.dot(step), equations.rows - kPointSize};
}

}  // namespace slcmap
