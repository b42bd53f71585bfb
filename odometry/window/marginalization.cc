#include "odometry/window/marginalization.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace slcmap::inline odometry {
namespace {

using Eigen::MatrixXd;

// Of a state's own information: added to all where they are dependent but for rounding.
constexpr double kRidge = 1e-9;

// What covariances of landmarks are asked for together with.
bool IsAskedForMost(const BlockKind& kind) {
  return kind.manifold == kPoseKind.manifold || kind.is_calibration;
}

}  // namespace

WindowCovariance::WindowCovariance(const StateInformation& information) {
  Order(information);
  Factorize(information);
}

void WindowCovariance::Order(const StateInformation& information) {
  order_.resize(information.blocks.size());
  std::iota(order_.begin(), order_.end(), size_t{0});
  std::stable_partition(order_.begin(), order_.end(),
                        [&](size_t k) { return !IsAskedForMost(information.kinds[k]); });
  for (const size_t k : order_) {
    const BlockKind& kind = information.kinds[k];
    columns_[information.blocks[k]] = {total_, kind.tangent_size};
    total_ += kind.tangent_size;
    if (!IsAskedForMost(kind)) first_pose_ = total_;
  }
}

void WindowCovariance::Factorize(const StateInformation& information) {
  std::vector<int> from(static_cast<size_t>(total_));  // column of `information`, by our own
  int column = 0;
  for (size_t k = 0; k < information.blocks.size(); ++k) {
    const Columns& ours = columns_.at(information.blocks[k]);
    for (int i = 0; i < ours.count; ++i) from[ours.offset + i] = column++;
  }
  scale_.resize(total_);
  for (int i = 0; i < total_; ++i) {
    const double diagonal = information.matrix(from[i], from[i]);
    scale_[i] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 1;
  }
  factor_ = MatrixXd::Zero(total_, total_);
  for (int j = 0; j < total_; ++j) {
    for (int i = j; i < total_; ++i) {
      const auto [low, high] = std::minmax(from[i], from[j]);
      factor_(i, j) = scale_[i] * information.matrix(high, low) * scale_[j];
    }
  }
  Eigen::LLT<MatrixXd, Eigen::Lower> cholesky(factor_);
  for (double ridge = kRidge; cholesky.info() != Eigen::Success && ridge < 1e-3; ridge *= 100) {
    factor_.diagonal().array() += ridge;
    cholesky.compute(factor_);
  }
  factor_ = cholesky.matrixLLT();
  if (cholesky.info() != Eigen::Success || !factor_.allFinite()) {  // nothing is known
    columns_.clear();
    return;
  }
  const int poses = total_ - first_pose_;
  const MatrixXd inverse = factor_.bottomRightCorner(poses, poses)
                               .triangularView<Eigen::Lower>()
                               .solve(MatrixXd::Identity(poses, poses));
  pose_covariance_ = inverse.transpose() * inverse;
}

// With information L L^T, the covariance of columns S is |L^-1 S|^2; above the first of them L^-1 S
// is zero.
MatrixXd WindowCovariance::Of(const std::vector<const double*>& blocks) const {
  std::vector<int> at;
  for (const double* block : blocks) {
    const Columns& columns = columns_.at(block);
    for (int i = 0; i < columns.count; ++i) at.push_back(columns.offset + i);
  }
  const auto count = static_cast<Eigen::Index>(at.size());
  MatrixXd covariance(count, count);
  const int first = at.empty() ? 0 : *std::min_element(at.begin(), at.end());
  if (first >= first_pose_) {
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index j = 0; j < count; ++j) {
        covariance(i, j) = pose_covariance_(at[i] - first_pose_, at[j] - first_pose_);
      }
    }
  } else {
    MatrixXd selected = MatrixXd::Zero(total_ - first, count);
    for (Eigen::Index i = 0; i < count; ++i) selected(at[i] - first, i) = 1;
    factor_.bottomRightCorner(total_ - first, total_ - first)
        .triangularView<Eigen::Lower>()
        .solveInPlace(selected);
    covariance = selected.transpose() * selected;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    covariance.row(i) *= scale_[at[i]];
    covariance.col(i) *= scale_[at[i]];
  }
  return covariance;
}

namespace {

// Of a column's own size: what is left of it beside the others and is smaller is rounding.
constexpr double kRankTolerance = 1e-12;

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Where a block's tangent stands among the columns.
struct Column {
  double* block = nullptr;
  BlockKind kind;
  int offset = 0;
  std::vector<double> x_lin;
};

// The columns of all state blocks: the dropped ones first, then the others in the order in which
// they were met.
class Layout {
 public:
  explicit Layout(const std::vector<double*>& dropped) : dropped_(dropped) {}

  void Meet(double* block, const BlockKind& kind, const double* linearization) {
    Column& column = columns_[block];
    if (column.block) {
      return;
    }
    column = {block, kind, 0, std::vector<double>(linearization, linearization + kind.size)};
    order_.push_back(block);
  }

  void Finish() {
    std::stable_partition(order_.begin(), order_.end(),
                          [&](double* block) { return IsDropped(block); });
    for (double* block : order_) {
      columns_[block].offset = total_;
      total_ += columns_[block].kind.tangent_size;
      if (IsDropped(block)) dropped_total_ = total_;
    }
  }

  bool IsDropped(double* block) const {
    return std::find(dropped_.begin(), dropped_.end(), block) != dropped_.end();
  }
  const Column& operator[](double* block) const { return columns_.at(block); }
  const std::vector<double*>& order() const { return order_; }
  int total() const { return total_; }
  int dropped_total() const { return dropped_total_; }

 private:
  std::vector<double*> dropped_;
  std::map<double*, Column> columns_;  // only looked up: the order of addresses decides nothing
  std::vector<double*> order_;
  int total_ = 0, dropped_total_ = 0;
};

// x minus x_lin of one block.
VectorXd Difference(const Column& column) {
  VectorXd difference(column.kind.tangent_size);
  BlockMinus(column.kind, column.block, column.x_lin.data(), difference.data());
  return difference;
}

// The row of the matrix [state columns | residual], and the landmark's columns beside it.
struct Rows {
  MatrixXd states;           // rows x (total + 1)
  Eigen::MatrixXd landmark;  // rows x kPointSize
};

// Rows of one term, shifted to speak of x minus x_lin, and weighted by the robust loss.
void LinearizeTerm(const Term& term, const Layout& layout, int first_row, Rows* rows) {
  const Factor& factor = *term.factor;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<RowMajor> jacobians;
  std::array<double*, Factor::kMaxBlocks> pointers{};
  for (int k = 0; k < factor.blocks(); ++k)
    jacobians.emplace_back(factor.rows(), factor.tangent_size(k));
  for (int k = 0; k < factor.blocks(); ++k) pointers[k] = jacobians[k].data();
  VectorXd residual(factor.rows());
  factor.Linearize(term.blocks.data(), residual.data(), pointers.data());

  double rho[3] = {0, 1, 0};
  if (term.loss) term.loss->Evaluate(residual.squaredNorm(), rho);
  const double weight = std::sqrt(rho[1]);
  auto target = rows->states.middleRows(first_row, factor.rows());
  for (int k = 0; k < factor.blocks(); ++k) {
    if (factor.kind(k).is_point) {
      rows->landmark.middleRows(first_row, factor.rows()) = weight * jacobians[k];
      continue;
    }
    const Column& column = layout[term.blocks[k]];
    residual -= jacobians[k] * Difference(column);
    target.middleCols(column.offset, factor.tangent_size(k)) += weight * jacobians[k];
  }
  target.rightCols<1>() += weight * residual;
}

// What rows say of the other columns once those of `gone` are eliminated, whatever their units:
// the reflections that make these triangular, applied to the others. As many rows go as `gone` has
// independent columns. Where it has fewer than columns (a line that was only seen from one plane
// through it, a depth without parallax), the rows beyond say nothing of it, and stay.
MatrixXd ProjectOut(const MatrixXd& gone, const MatrixXd& others) {
  if (gone.cols() == 0) return others;
  const VectorXd size = gone.colwise().norm();
  const VectorXd scale = (size.array() > 0).select(size.cwiseInverse(), 1.0);
  Eigen::ColPivHouseholderQR<MatrixXd> qr(gone.rows(), gone.cols());
  qr.setThreshold(kRankTolerance);
  qr.compute(gone * scale.asDiagonal());
  MatrixXd turned = others;
  turned.applyOnTheLeft(qr.householderQ().adjoint());
  return turned.bottomRows(others.rows() - qr.rank());
}

double* GetLandmark(const Term& term) {
  const int last = term.factor->blocks() - 1;
  return term.factor->kind(last).is_point ? term.blocks[last] : nullptr;
}

// Terms grouped by their landmark, in the order in which the landmarks were met; those without one
// come first.
std::vector<std::vector<const Term*>> GroupByLandmark(const std::vector<Term>& terms) {
  std::vector<std::vector<const Term*>> groups(1);
  std::map<double*, size_t> group_of;
  for (const Term& term : terms) {
    double* landmark = GetLandmark(term);
    size_t group = 0;
    if (landmark) {
      group = group_of.try_emplace(landmark, groups.size()).first->second;
      if (group == groups.size()) groups.emplace_back();
    }
    groups[group].push_back(&term);
  }
  return groups;
}

Rows LinearizeGroup(const std::vector<const Term*>& group, const Layout& layout) {
  int count = 0;
  for (const Term* term : group) count += term->factor->rows();
  Rows rows{MatrixXd::Zero(count, layout.total() + 1), MatrixXd::Zero(count, kPointSize)};
  int row = 0;
  for (const Term* term : group) {
    LinearizeTerm(*term, layout, row, &rows);
    row += term->factor->rows();
  }
  return rows;
}

MatrixXd PriorRows(const Prior& prior, const Layout& layout) {
  MatrixXd rows = MatrixXd::Zero(prior.residual.size(), layout.total() + 1);
  int offset = 0;
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    const int tangent = prior.kinds[k].tangent_size;
    rows.middleCols(layout[prior.blocks[k]].offset, tangent) =
        prior.jacobian.middleCols(offset, tangent);
    offset += tangent;
  }
  rows.rightCols<1>() = prior.residual;
  return rows;
}

Layout BuildLayout(const std::vector<Term>& terms, const Prior& prior,
                   const std::vector<double*>& dropped) {
  Layout layout(dropped);
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    layout.Meet(prior.blocks[k], prior.kinds[k], prior.x_lin[k].data());
  }
  for (const Term& term : terms) {
    for (int k = 0; k < term.factor->blocks(); ++k) {
      const BlockKind& kind = term.factor->kind(k);
      if (!kind.is_point) layout.Meet(term.blocks[k], kind, term.blocks[k]);
    }
  }
  layout.Finish();
  return layout;
}

MatrixXd Stack(const std::vector<MatrixXd>& parts, int columns) {
  Eigen::Index count = 0;
  for (const MatrixXd& part : parts) count += part.rows();
  MatrixXd all(count, columns);
  Eigen::Index row = 0;
  for (const MatrixXd& part : parts) {
    all.middleRows(row, part.rows()) = part;
    row += part.rows();
  }
  return all;
}

// Of rows [kept columns | residual].
Prior PriorFromRows(const MatrixXd& all, const Layout& layout) {
  Prior out;
  for (double* block : layout.order()) {
    if (layout.IsDropped(block)) continue;
    out.blocks.push_back(block);
    out.kinds.push_back(layout[block].kind);
    out.x_lin.push_back(layout[block].x_lin);
  }
  const Eigen::HouseholderQR<MatrixXd> qr(all);
  const Eigen::Index kept = all.cols() - 1, rows = std::min(kept, all.rows());
  out.jacobian = qr.matrixQR().topLeftCorner(rows, kept).triangularView<Eigen::Upper>();
  out.residual = qr.matrixQR().topRightCorner(rows, 1);
  return out;
}

}  // namespace

Prior Marginalize(const std::vector<Term>& terms, const Prior& prior,
                  const std::vector<double*>& dropped) {
  const Layout layout = BuildLayout(terms, prior, dropped);
  std::vector<MatrixXd> parts;
  const auto groups = GroupByLandmark(terms);
  parts.push_back(PriorRows(prior, layout));
  parts.push_back(LinearizeGroup(groups[0], layout).states);
  for (size_t g = 1; g < groups.size(); ++g) {
    const Rows rows = LinearizeGroup(groups[g], layout);
    parts.push_back(ProjectOut(rows.landmark, rows.states));
  }
  const MatrixXd all = Stack(parts, layout.total() + 1);
  const int first = layout.dropped_total();
  return PriorFromRows(ProjectOut(all.leftCols(first), all.rightCols(all.cols() - first)), layout);
}

}  // namespace slcmap::odometry
