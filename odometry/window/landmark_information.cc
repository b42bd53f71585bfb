#include "odometry/window/landmark_information.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <memory>

#include "odometry/factors/factor.h"
#include "odometry/factors/line_constraints.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajorXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Of the prior and of the observations in the window, on the tangent of a line's block.
Eigen::MatrixXd InformationOn(const LineLandmark& line, const CostModel& model,
                              const Prior& prior) {
  const int size = line.kind().tangent_size;
  std::vector<FixedTerm> terms;
  for (const FrameState* frame : line.frames) terms.push_back(FixedLineTerm(line, *frame, model));
  if (line.MayDeviate()) terms.push_back(FixedAlongAxisTerm(line, model));
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

// How a line's place across it, at one of its points, moves with its tangent: by central
// differences.
Eigen::Matrix3Xd PlaceByLine(const LineLandmark& line, const Vector3d& p_world) {
  constexpr double kStep = 1e-6;
  const int size = line.kind().tangent_size;
  const Vector3d direction = line.InWorld().direction_world;
  Eigen::Matrix3Xd by_tangent(3, size);
  for (int i = 0; i < size; ++i) {
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
  return by_tangent;
}

// A structural line turns with its heading about its anchor.
Vector3d PlaceByHeading(const LineLandmark& line, const Vector3d& p_world) {
  const Vector3d direction = AxisDirection(line.axis, line.heading_rad());
  const Vector3d moved = Vector3d::UnitZ().cross(p_world - line.anchor_world);
  return moved - direction * direction.dot(moved);
}

// How a point's place moves with its block, in the axes of the world.
Matrix3d PlaceByPoint(const PointLandmark& point, const CostModel& model) {
  const double depth_m = 1 / point.inverse_depth_per_m();
  Matrix3d by_point = depth_m * Matrix3d::Identity();
  by_point.col(2) = -depth_m * depth_m * Vector3d(point.point[0], point.point[1], 1);
  return (point.host()->T_world_imu().rotation * model.geometry.T_imu_camera[point.camera].rotation)
             .toRotationMatrix() *
         by_point;
}

template <typename Ldlt>
bool IsRegular(const Ldlt& ldlt) {
  const auto pivots = ldlt.vectorD();
  return pivots.minCoeff() > 1e-12 * pivots.maxCoeff();
}

// What the terms of a point say of it and of the states that they bind.
struct PointEquations {
  Matrix3d information = Matrix3d::Zero();
  std::vector<const double*> states;
  std::vector<Eigen::Index> columns;  // first one of each state
  Eigen::Matrix3Xd cross;

  Eigen::Index FindColumn(const double* state, int tangent_size) {
    const auto at = std::find(states.begin(), states.end(), state);
    if (at != states.end()) return columns[static_cast<size_t>(at - states.begin())];
    states.push_back(state);
    columns.push_back(cross.cols());
    cross.conservativeResize(3, cross.cols() + tangent_size);
    cross.rightCols(tangent_size).setZero();
    return columns.back();
  }
};

// With the weight that the loss gives it. A term with a state that the window does not know is left
// out.
void AddToPoint(const FixedTerm& term, const WindowCovariance& window, PointEquations* equations) {
  const Factor& factor = *term.factor;
  const int last = factor.blocks() - 1;
  std::array<RowMajorXd, Factor::kMaxBlocks> jacobians;
  std::array<double*, Factor::kMaxBlocks> pointers{};
  for (int k = 0; k <= last; ++k) {
    if (k < last && !window.Knows(term.blocks[k])) return;
    jacobians[k].resize(factor.rows(), factor.tangent_size(k));
    pointers[k] = jacobians[k].data();
  }
  Eigen::VectorXd residual(factor.rows());
  factor.Linearize(term.blocks.data(), residual.data(), pointers.data());
  double rho[3] = {0, 1, 0};
  if (term.loss) term.loss->Evaluate(residual.squaredNorm(), rho);
  const Eigen::Matrix3Xd weighted = rho[1] * jacobians[last].transpose();
  equations->information += weighted * jacobians[last];
  for (int k = 0; k < last; ++k) {
    const int size = factor.tangent_size(k);
    const Eigen::Index column = equations->FindColumn(term.blocks[k], size);
    equations->cross.middleCols(column, size) += weighted * jacobians[k];
  }
}

}  // namespace

Eigen::Vector4d ComputeResidual(const FixedTerm& term) {
  Eigen::Vector4d residual = Eigen::Vector4d::Zero();
  term.factor->Evaluate(term.blocks.data(), residual.data(), nullptr);
  return residual;
}

std::pair<double, double> Chi2OfObservation(const FixedTerm& term) {
  const Eigen::Vector4d residual = ComputeResidual(term);
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

std::optional<Matrix3d> CovarianceFromHost(const PointLandmark& point, const CostModel& model,
                                           const WindowCovariance& window) {
  PointEquations equations;
  for (const FixedTerm& term : FixedPointTerms(point, model)) {
    AddToPoint(term, window, &equations);
  }
  const Eigen::LDLT<Matrix3d> ldlt(equations.information);
  if (!IsRegular(ldlt)) return std::nullopt;
  // The point follows the poses by -H_pp^-1 H_ps, beside its own noise.
  const Eigen::Matrix3Xd gain = ldlt.solve(equations.cross);
  const Matrix3d covariance =
      ldlt.solve(Matrix3d::Identity()) + gain * window.Of(equations.states) * gain.transpose();
  const Matrix3d by_point = PlaceByPoint(point, model);
  return by_point * covariance * by_point.transpose();
}

std::optional<Matrix3d> CovarianceAcross(const LineLandmark& line, const Vector3d& p_world,
                                         const FrameState& from, const WindowCovariance& window) {
  if (!window.Knows(line.block.data()) || !window.Knows(from.pose.data())) return std::nullopt;
  std::vector<const double*> blocks{line.block.data()};
  Eigen::Matrix3Xd moved = PlaceByLine(line, p_world);
  if (line.IsExact() && line.heading && window.Knows(line.heading->heading_rad.data())) {
    blocks.push_back(line.heading->heading_rad.data());
    moved.conservativeResize(3, moved.cols() + 1);
    moved.rightCols<1>() = PlaceByHeading(line, p_world);
  }
  // R_from (R_from^T (p - p_from)), by the pose: as the frame moves, the line moves the other way.
  const RigidTransform T_world_from = from.T_world_imu();
  const Vector3d p_from = T_world_from.Inverse() * p_world;
  blocks.push_back(from.pose.data());
  moved.conservativeResize(3, moved.cols() + 6);
  moved.rightCols<6>() << -Matrix3d::Identity(),
      T_world_from.rotation.toRotationMatrix() * Skew(p_from);
  const Vector3d direction = line.InWorld().direction_world;
  moved -= direction * (direction.transpose() * moved).eval();
  return moved * window.Of(blocks) * moved.transpose();
}

std::optional<LineDeviation> DeviationFromAxis(const LineLandmark& line,
                                               const WindowCovariance& window) {
  std::unique_ptr<Factor> residual;
  std::vector<const double*> blocks;
  if (line.slope) {
    residual = std::make_unique<AlongSlopeResidual>(1);
    blocks.push_back(line.slope->angles_rad.data());
  } else {
    residual = std::make_unique<AlongAxisResidual>(line.axis, 1);
    if (line.heading) blocks.push_back(line.heading->heading_rad.data());
  }
  blocks.push_back(line.block.data());
  std::vector<RowMajorXd> jacobians;
  std::vector<double*> pointers;
  Eigen::Index columns = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    if (!window.Knows(blocks[k])) return std::nullopt;
    jacobians.emplace_back(2, residual->tangent_size(static_cast<int>(k)));
    columns += jacobians.back().cols();
  }
  for (RowMajorXd& jacobian : jacobians) pointers.push_back(jacobian.data());
  LineDeviation out;
  residual->Linearize(blocks.data(), out.off_rad.data(), pointers.data());
  Eigen::Matrix<double, 2, Eigen::Dynamic> moved(2, columns);
  columns = 0;
  for (const RowMajorXd& jacobian : jacobians) {
    moved.middleCols(columns, jacobian.cols()) = jacobian;
    columns += jacobian.cols();
  }
  if (!line.shared || !window.Knows(line.shared->off_rad.data())) {
    out.covariance_rad2 = moved * window.Of(blocks) * moved.transpose();
    return out;
  }
  blocks.push_back(line.shared->off_rad.data());
  const Eigen::Index size = moved.cols();
  const Eigen::MatrixXd covariance = window.Of(blocks);
  out.covariance_rad2 = moved * covariance.topLeftCorner(size, size) * moved.transpose();
  out.shared_rad = Eigen::Map<const Eigen::Vector2d>(line.shared->off_rad.data());
  out.shared_variance_rad2 = covariance.bottomRightCorner<2, 2>().diagonal();
  out.cross_covariance_rad2 = (moved * covariance.topRightCorner(size, 2)).diagonal();
  return out;
}

Matrix3d ConditionalCovarianceAcross(const LineLandmark& line, const Vector3d& p_world,
                                     const CostModel& model, const Prior& prior) {
  const Eigen::MatrixXd information = InformationOn(line, model, prior);
  const Eigen::Index size = information.rows();
  const Eigen::MatrixXd covariance =
      (information + 1e-9 * Eigen::MatrixXd::Identity(size, size)).inverse();
  const Eigen::Matrix3Xd by_tangent = PlaceByLine(line, p_world);
  return by_tangent * covariance * by_tangent.transpose();
}

std::optional<PointPlace> PlaceByObservations(const PointLandmark& point, const CostModel& model) {
  const BlockEquations equations = EquationsOnLast(FixedPointTerms(point, model), kPointSize);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(equations.information);
  if (!IsRegular(ldlt)) return std::nullopt;
  const Vector3d step = ldlt.solve(equations.gradient);
  PointLandmark copy = point;
  Eigen::Map<Vector3d>{copy.point.data()} -= step;
  if (!(copy.inverse_depth_per_m() > 0)) return std::nullopt;
  const Matrix3d by_point = PlaceByPoint(copy, model);
  const Matrix3d covariance = ldlt.solve(Matrix3d::Identity());
  return PointPlace{
      LandmarkInWorld(copy, model.geometry), by_point * covariance * by_point.transpose(),
      equations.squared_residuals - equations.gradient.dot(step), equations.rows - kPointSize};
}

}  // namespace slcmap::odometry
