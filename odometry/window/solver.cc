#include "odometry/window/solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "odometry/factors/factor.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Rows below a block that are not zero in its columns.
std::vector<Index> RowsBelow(const MatrixXd& matrix, Index offset, Index size) {
  std::vector<Index> rows;
  for (Index row = offset + size; row < matrix.rows(); ++row) {
    if ((matrix.row(row).segment(offset, size).array() != 0).any()) rows.push_back(row);
  }
  return rows;
}

bool EliminateBlock(Index offset, Index size, MatrixXd* matrix) {
  const Eigen::LLT<MatrixXd> own(matrix->block(offset, offset, size, size));
  if (own.info() != Eigen::Success) return false;
  matrix->block(offset, offset, size, size).triangularView<Eigen::Lower>() = own.matrixL();
  const std::vector<Index> rows = RowsBelow(*matrix, offset, size);
  const auto count = static_cast<Index>(rows.size());
  MatrixXd below(size, count);
  for (Index i = 0; i < count; ++i) {
    below.col(i) = matrix->row(rows[i]).segment(offset, size).transpose();
  }
  own.matrixL().solveInPlace(below);
  const MatrixXd product = below.transpose() * below;
  for (Index j = 0; j < count; ++j) {
    matrix->row(rows[j]).segment(offset, size) = below.col(j).transpose();
    for (Index i = j; i < count; ++i) (*matrix)(rows[i], rows[j]) -= product(i, j);
  }
  return true;
}

}  // namespace

bool FactorizeBlocks(const std::vector<int>& leading_sizes, MatrixXd* matrix) {
  Index offset = 0;
  for (const int size : leading_sizes) {
    if (!EliminateBlock(offset, size, matrix)) return false;
    offset += size;
  }
  const Index rest = matrix->rows() - offset;
  if (rest == 0) return true;
  Eigen::Ref<MatrixXd> corner = matrix->bottomRightCorner(rest, rest);
  const Eigen::LLT<Eigen::Ref<MatrixXd>, Eigen::Lower> dense(corner);
  return dense.info() == Eigen::Success;
}

namespace {

// The calibration of the IMU is the largest block, and what ties it to what was given the longest
// residual.
constexpr int kMaxRows = kImuCalibrationSize, kMaxTangent = kImuCalibrationSize;
static_assert(kMaxRows >= 15 && kMaxTangent >= 9);

using RowMajor =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxRows, kMaxTangent>;
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;

// The diagonal that damping is relative to, within Ceres' bounds.
double Damping(double diagonal, double radius) { return std::clamp(diagonal, 1e-6, 1e32) / radius; }

double RobustCost(const Term& term, double squared_norm, double* weight) {
  double rho[3] = {squared_norm, 1, 0};
  if (term.loss) term.loss->Evaluate(squared_norm, rho);
  *weight = rho[1];
  return 0.5 * rho[0];
}

}  // namespace

NormalEquations::NormalEquations(const std::vector<Term>& terms, const Prior& prior,
                                 const std::function<bool(const double*)>& is_constant)
    : terms_(terms), prior_(prior) {
  int column = 0;
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    Meet(prior.blocks[k], prior.kinds[k], is_constant);
    prior_unknowns_.push_back(index_.at(prior.blocks[k]));
    prior_columns_.push_back(column);
    column += prior.kinds[k].tangent_size;
  }
  const size_t bound = unknowns_.size();
  for (const Term& term : terms) {
    Binding& binding = bindings_.emplace_back();
    for (int k = 0; k < term.factor->blocks(); ++k) {
      Meet(term.blocks[k], term.factor->kind(k), is_constant);
      binding.unknown[k] = index_.at(term.blocks[k]);
    }
  }
  PlaceUnknowns(bound);
  AddPriorHessian();
}

void NormalEquations::PlaceUnknowns(size_t bound) {
  const auto place = [&](bool leading) {
    for (size_t i = 0; i < unknowns_.size(); ++i) {
      Unknown& unknown = unknowns_[i];
      if (unknown.is_point || leading != (unknown.kind.is_line && i >= bound)) continue;
      unknown.offset = total_;
      total_ += unknown.tangent;
      if (leading) leading_sizes_.push_back(unknown.tangent);
    }
  };
  place(true);
  place(false);
}

void NormalEquations::Meet(double* block, const BlockKind& kind,
                           const std::function<bool(const double*)>& is_constant) {
  if (!index_.try_emplace(block, static_cast<int>(unknowns_.size())).second) return;
  if (is_constant(block)) {
    index_[block] = -1;
    return;
  }
  Unknown unknown{block, kind, kind.tangent_size, 0, kind.is_point};
  if (unknown.is_point) {
    unknown.offset = static_cast<int>(points_.size());
    points_.emplace_back().unknown = static_cast<int>(unknowns_.size());
  }
  unknowns_.push_back(unknown);
}

// Constant, since the prior is linear in its blocks' differences.
void NormalEquations::AddPriorHessian() {
  prior_hessian_ = Eigen::MatrixXd::Zero(total_, total_);
  const Eigen::Index size = prior_.jacobian.cols();
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(size, size);
  product.selfadjointView<Eigen::Lower>().rankUpdate(prior_.jacobian.transpose());
  product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
  for (size_t i = 0; i < prior_unknowns_.size(); ++i) {
    for (size_t j = 0; j < prior_unknowns_.size(); ++j) {
      if (prior_unknowns_[i] < 0 || prior_unknowns_[j] < 0) continue;
      const Unknown& a = unknowns_[prior_unknowns_[i]];
      const Unknown& b = unknowns_[prior_unknowns_[j]];
      prior_hessian_.block(a.offset, b.offset, a.tangent, b.tangent) =
          product.block(prior_columns_[i], prior_columns_[j], a.tangent, b.tangent);
    }
  }
}

Eigen::VectorXd NormalEquations::PriorDifference() const {
  return prior_.residual + prior_.jacobian * prior_.Difference(prior_.blocks.data());
}

double NormalEquations::Cost() const {
  double cost = prior_.empty() ? 0 : 0.5 * PriorDifference().squaredNorm();
  std::array<double, kMaxRows> residual;
  for (const Term& term : terms_) {
    term.factor->Linearize(term.blocks.data(), residual.data(), nullptr);
    double weight;
    cost += RobustCost(
        term, Eigen::Map<const Residual>(residual.data(), term.factor->rows()).squaredNorm(),
        &weight);
  }
  return cost;
}

void NormalEquations::Linearize() {
  hessian_ = prior_hessian_;
  gradient_ = Eigen::VectorXd::Zero(total_);
  if (!prior_.empty()) {
    const Eigen::VectorXd product = prior_.jacobian.transpose() * PriorDifference();
    for (size_t k = 0; k < prior_unknowns_.size(); ++k) {
      if (prior_unknowns_[k] < 0) continue;
      const Unknown& unknown = unknowns_[prior_unknowns_[k]];
      gradient_.segment(unknown.offset, unknown.tangent) +=
          product.segment(prior_columns_[k], unknown.tangent);
    }
  }
  for (PointSystem& point : points_) {
    point.hessian.setZero();
    point.gradient.setZero();
    point.cross.setZero();
  }
  for (size_t i = 0; i < terms_.size(); ++i) AddTerm(terms_[i], bindings_[i]);
}

int NormalEquations::CrossColumn(PointSystem* point, int unknown) const {
  for (const auto& [known, column] : point->states) {
    if (known == unknown) return column;
  }
  const int column = static_cast<int>(point->cross.cols());
  point->states.emplace_back(unknown, column);
  point->cross.conservativeResize(3, column + unknowns_[unknown].tangent);
  point->cross.rightCols(unknowns_[unknown].tangent).setZero();
  return column;
}

void NormalEquations::AddTerm(const Term& term, const Binding& binding) {
  const Factor& factor = *term.factor;
  const int blocks = factor.blocks(), rows = factor.rows();
  std::array<RowMajor, Factor::kMaxBlocks> jacobians;
  std::array<double*, Factor::kMaxBlocks> pointers{};
  for (int k = 0; k < blocks; ++k) {
    if (binding.unknown[k] < 0) continue;
    jacobians[k].resize(rows, factor.tangent_size(k));
    pointers[k] = jacobians[k].data();
  }
  Residual residual(rows);
  factor.Linearize(term.blocks.data(), residual.data(), pointers.data());
  double weight;
  RobustCost(term, residual.squaredNorm(), &weight);
  PointSystem* point = nullptr;
  for (int a = blocks - 1; a >= 0; --a) {
    if (binding.unknown[a] < 0) continue;
    const Unknown& of_a = unknowns_[binding.unknown[a]];
    const RowMajor weighted = weight * jacobians[a];
    if (of_a.is_point) {
      point = &points_[of_a.offset];
      point->hessian += weighted.transpose().lazyProduct(jacobians[a]);
      point->gradient += weighted.transpose().lazyProduct(residual);
      continue;
    }
    gradient_.segment(of_a.offset, of_a.tangent) += weighted.transpose().lazyProduct(residual);
    if (point) {
      const int column = CrossColumn(point, binding.unknown[a]);
      point->cross.middleCols(column, of_a.tangent) +=
          jacobians[blocks - 1].transpose().lazyProduct(weighted);
    }
    for (int b = 0; b < blocks; ++b) {
      if (binding.unknown[b] < 0) continue;
      const Unknown& of_b = unknowns_[binding.unknown[b]];
      if (of_b.is_point || of_b.offset > of_a.offset) continue;
      hessian_.block(of_a.offset, of_b.offset, of_a.tangent, of_b.tangent) +=
          weighted.transpose().lazyProduct(jacobians[b]);
    }
  }
}

void NormalEquations::Eliminate(PointSystem* point, double radius, Eigen::MatrixXd* hessian,
                                Eigen::VectorXd* gradient) {
  Eigen::Matrix3d damped = point->hessian;
  for (int i = 0; i < 3; ++i) damped(i, i) += Damping(damped(i, i), radius);
  point->inverse = damped.inverse();
  const Eigen::Matrix3Xd scaled = point->inverse * point->cross;
  for (const auto& [a, column_a] : point->states) {
    const Unknown& of_a = unknowns_[a];
    const auto cross_a = point->cross.middleCols(column_a, of_a.tangent);
    gradient->segment(of_a.offset, of_a.tangent) -=
        scaled.middleCols(column_a, of_a.tangent).transpose().lazyProduct(point->gradient);
    for (const auto& [b, column_b] : point->states) {
      const Unknown& of_b = unknowns_[b];
      if (of_b.offset > of_a.offset) continue;
      hessian->block(of_a.offset, of_b.offset, of_a.tangent, of_b.tangent) -=
          cross_a.transpose().lazyProduct(scaled.middleCols(column_b, of_b.tangent));
    }
  }
}

std::optional<double> NormalEquations::SolveDamped(double radius) {
  Eigen::MatrixXd reduced = hessian_;
  Eigen::VectorXd right = gradient_;
  for (int i = 0; i < total_; ++i) reduced(i, i) += Damping(hessian_(i, i), radius);
  for (PointSystem& point : points_) Eliminate(&point, radius, &reduced, &right);
  if (!FactorizeBlocks(leading_sizes_, &reduced)) return std::nullopt;
  step_ = -right;
  reduced.triangularView<Eigen::Lower>().solveInPlace(step_);
  reduced.triangularView<Eigen::Lower>().transpose().solveInPlace(step_);
  for (PointSystem& point : points_) {
    point.step = -point.gradient;
    for (const auto& [state, column] : point.states) {
      const Unknown& unknown = unknowns_[state];
      point.step -= point.cross.middleCols(column, unknown.tangent)
                        .lazyProduct(step_.segment(unknown.offset, unknown.tangent));
    }
    point.step = point.inverse * point.step;
  }
  return PredictedDecrease(radius);
}

// With (H + D) dx = -g, the model's decrease is -g.dx - dx.H.dx / 2 = (-g.dx + dx.D.dx) / 2: never
// negative where H + D is positive definite.
std::optional<double> NormalEquations::PredictedDecrease(double radius) const {
  double sum = -gradient_.dot(step_);
  for (int i = 0; i < total_; ++i) sum += Damping(hessian_(i, i), radius) * step_[i] * step_[i];
  for (const PointSystem& point : points_) {
    sum -= point.gradient.dot(point.step);
    for (int i = 0; i < 3; ++i) {
      sum += Damping(point.hessian(i, i), radius) * point.step[i] * point.step[i];
    }
  }
  if (!std::isfinite(sum)) return std::nullopt;
  // At a minimum it is rounding; what is really negative is not.
  const double rounding = 1e-9 * gradient_.cwiseAbs().dot(step_.cwiseAbs());
  if (sum < -rounding) return std::nullopt;
  return 0.5 * std::max(sum, 0.0);
}

StateInformation NormalEquations::Information() {
  constexpr double kUndamped = 1e8;  // keeps a point that was seen along one ray regular
  StateInformation out;
  if (hessian_.size() == 0) return out;
  std::vector<const Unknown*> states;
  for (const Unknown& unknown : unknowns_) {
    if (!unknown.is_point) states.push_back(&unknown);
  }
  std::sort(states.begin(), states.end(),
            [](const Unknown* a, const Unknown* b) { return a->offset < b->offset; });
  for (const Unknown* state : states) {
    out.blocks.push_back(state->block);
    out.kinds.push_back(state->kind);
  }
  out.matrix = hessian_;
  Eigen::VectorXd gradient = gradient_;
  for (PointSystem& point : points_) Eliminate(&point, kUndamped, &out.matrix, &gradient);
  return out;
}

void NormalEquations::Apply() {
  before_.clear();
  for (const Unknown& unknown : unknowns_) {
    before_.insert(before_.end(), unknown.block, unknown.block + unknown.kind.size);
    const double* step =
        unknown.is_point ? points_[unknown.offset].step.data() : step_.data() + unknown.offset;
    BlockPlus(unknown.kind, before_.data() + before_.size() - unknown.kind.size, step,
              unknown.block);
  }
}

void NormalEquations::Undo() {
  const double* from = before_.data();
  for (const Unknown& unknown : unknowns_) {
    std::copy_n(from, unknown.kind.size, unknown.block);
    from += unknown.kind.size;
  }
}

namespace {

// The size of the region in which the linear model is trusted (Madsen, Nielsen and Tingleff,
// "Methods for Non-Linear Least Squares Problems", 2004, section 3.2), with Ceres' constants.
class TrustRegion {
 public:
  double radius() const { return radius_; }
  void Accept(double gain_ratio) {
    radius_ /= std::max(1.0 / 3, 1 - std::pow(2 * gain_ratio - 1, 3));
    radius_ = std::min(radius_, 1e16);
    shrink_ = 2;
  }
  void Reject() {
    radius_ /= shrink_;
    shrink_ *= 2;
  }

 private:
  double radius_ = 1e4, shrink_ = 2;
};

// The predicted decrease of the cost, with more damping as long as the system cannot be solved:
// after many good steps the damping may be lost in the rounding of H. Nothing where damping does
// not help.
std::optional<double> SolveDamped(NormalEquations* equations, TrustRegion* region) {
  constexpr int kMaxAttempts = 6;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const std::optional<double> predicted = equations->SolveDamped(region->radius());
    if (predicted) return predicted;
    region->Reject();
  }
  return std::nullopt;
}

}  // namespace

SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options, StateInformation* information) {
  constexpr double kMinGainRatio = 1e-3;
  constexpr int kMaxRejections = 5;  // in a row
  NormalEquations equations(*terms, prior, is_constant);
  TrustRegion region;
  SolverSummary summary;
  summary.initial_cost = summary.final_cost = equations.Cost();
  summary.usable = std::isfinite(summary.initial_cost);
  int rejections = 0;
  bool stop = !summary.usable;
  while (!stop && summary.iterations < options.max_iterations) {
    if (rejections == 0) equations.Linearize();
    ++summary.iterations;
    const std::optional<double> predicted = SolveDamped(&equations, &region);
    if (!predicted) {
      summary.usable = false;
      break;
    }
    equations.Apply();
    const double cost = equations.Cost();
    const double gain_ratio = *predicted > 0 ? (summary.final_cost - cost) / *predicted : 0;
    if (std::isfinite(cost) && gain_ratio > kMinGainRatio) {
      stop = summary.final_cost - cost <= options.function_tolerance * summary.final_cost;
      summary.final_cost = cost;
      region.Accept(gain_ratio);
      rejections = 0;
    } else {
      equations.Undo();
      region.Reject();
      stop = ++rejections > kMaxRejections ||
             *predicted <= options.function_tolerance * summary.final_cost;
    }
  }
  if (information) {
    *information = summary.iterations > 0 ? equations.Information() : StateInformation();
  }
  return summary;
}

}  // namespace slcmap::odometry
