#include "odometry/window/marginalization.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>

#include "tests/odometry/window/lines_in_window.h"

namespace slcmap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Dense normal equations of terms and prior over all blocks: the straightforward way.
class Dense {
 public:
  Dense(const std::vector<Term>& terms, const Prior& prior) {
    for (size_t k = 0; k < prior.blocks.size(); ++k) Meet(prior.blocks[k], prior.kinds[k]);
    for (const Term& term : terms) {
      for (int k = 0; k < term.factor->blocks(); ++k) Meet(term.blocks[k], term.factor->kind(k));
    }
    h_ = MatrixXd::Zero(total_, total_);
    b_ = VectorXd::Zero(total_);
    AddPrior(prior);
    for (const Term& term : terms) AddTerm(term);
  }

  // The Schur complement that is left of the blocks of a prior, and its gradient at the blocks'
  // values.
  std::pair<MatrixXd, VectorXd> ReducedTo(const Prior& prior) const {
    std::vector<int> kept, dropped;
    for (size_t k = 0; k < prior.blocks.size(); ++k) {
      const int offset = offsets_[Find(prior.blocks[k])];
      for (int d = 0; d < prior.kinds[k].tangent_size; ++d) kept.push_back(offset + d);
    }
    for (int i = 0; i < total_; ++i) {
      if (std::find(kept.begin(), kept.end(), i) == kept.end()) dropped.push_back(i);
    }
    const MatrixXd gain = h_(dropped, dropped).ldlt().solve(h_(dropped, kept));
    return {h_(kept, kept) - h_(kept, dropped) * gain, b_(kept) - gain.transpose() * b_(dropped)};
  }

 private:
  size_t Find(const double* block) const {
    return static_cast<size_t>(std::find(blocks_.begin(), blocks_.end(), block) - blocks_.begin());
  }
  void Meet(const double* block, const BlockKind& kind) {
    if (Find(block) < blocks_.size()) return;
    blocks_.push_back(block);
    offsets_.push_back(total_);
    total_ += kind.tangent_size;
  }
  void Add(const MatrixXd& jacobian, const VectorXd& residual) {
    h_ += jacobian.transpose() * jacobian;
    b_ += jacobian.transpose() * residual;
  }
  void AddPrior(const Prior& prior) {
    if (prior.empty()) return;
    MatrixXd jacobian = MatrixXd::Zero(prior.residual.size(), total_);
    for (size_t k = 0; k < prior.blocks.size(); ++k) {
      const int size = prior.kinds[k].tangent_size;
      jacobian.middleCols(offsets_[Find(prior.blocks[k])], size) =
          prior.jacobian.middleCols(prior.TangentOffset(static_cast<int>(k)), size);
    }
    Add(jacobian, prior.residual + prior.jacobian * prior.Difference(prior.blocks.data()));
  }
  void AddTerm(const Term& term) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Factor& factor = *term.factor;
    std::vector<RowMajor> parts;
    std::array<double*, Factor::kMaxBlocks> outputs{};
    for (int k = 0; k < factor.blocks(); ++k) {
      parts.emplace_back(factor.rows(), factor.tangent_size(k));
    }
    for (int k = 0; k < factor.blocks(); ++k) outputs[k] = parts[k].data();
    VectorXd residual(factor.rows());
    factor.Linearize(term.blocks.data(), residual.data(), outputs.data());
    MatrixXd jacobian = MatrixXd::Zero(factor.rows(), total_);
    for (int k = 0; k < factor.blocks(); ++k) {
      jacobian.middleCols(offsets_[Find(term.blocks[k])], factor.tangent_size(k)) += parts[k];
    }
    Add(jacobian, residual);
  }

  std::vector<const double*> blocks_;
  std::vector<int> offsets_;
  int total_ = 0;
  MatrixXd h_;
  VectorXd b_;
};

void ExpectSame(const Prior& prior, const Dense& dense) {
  const auto [h, b] = dense.ReducedTo(prior);
  const VectorXd residual = prior.residual + prior.jacobian * prior.Difference(prior.blocks.data());
  EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - h).norm(), 1e-6 * h.norm());
  EXPECT_LT((prior.jacobian.transpose() * residual - b).norm(), 1e-5 * (b.norm() + h.norm()));
  EXPECT_GT(b.norm(), 1);
}

using MarginalizeTest = LinesInWindow;

TEST_F(MarginalizeTest, IsTheSchurComplementOfTheNormalEquations) {
  Move(0.01);
  const std::vector<double*> dropped{poses_[0].data(), structural_[0].data()};
  const std::vector<Term> first = TakeTermsOf(dropped);
  const Prior prior = Marginalize(first, Prior(), dropped);
  ExpectSame(prior, Dense(first, Prior()));

  // Once more where the estimates have moved on from where the prior was linearised.
  KeepLinearization(prior);
  Move(0.01);
  const Prior next = Marginalize(terms_, prior, {poses_[1].data(), general_.data()});
  ASSERT_EQ(next.blocks.size(), 6u);  // two poses, the heading, two lines, the cameras
  ExpectSame(next, Dense(terms_, prior));
}

// r = A x + B y - c, of any two blocks of three numbers.
class LinearResidual final : public Factor {
 public:
  LinearResidual(const BlockKind& of_x, MatrixXd a, MatrixXd b, VectorXd c)
      : Factor(static_cast<int>(c.size()), {BlockKind{3, 3}, of_x}),
        a_(std::move(a)),
        b_(std::move(b)),
        c_(std::move(c)) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    using Eigen::Vector3d;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
    VectorXd::Map(residuals, rows()) =
        a_ * Vector3d::Map(parameters[1]) + b_ * Vector3d::Map(parameters[0]) - c_;
    if (!jacobians) return;
    if (jacobians[0]) RowMajor::Map(jacobians[0], rows(), 3) = b_;
    if (jacobians[1]) RowMajor::Map(jacobians[1], rows(), 3) = a_;
  }

 private:
  MatrixXd a_, b_;
  VectorXd c_;
};

// Of three columns two that are independent, in units far apart.
MatrixXd DependentColumns(int rows) {
  std::srand(3);
  MatrixXd a = MatrixXd::Random(rows, 3);
  a.col(2) = 1e7 * (a.col(0) - 0.5 * a.col(1));
  a.col(1) *= 1e-6;
  return a;
}

// What is left of y where x is eliminated by any means: |P (B y - c)|^2, P the projection off A.
void ExpectNothingLostOrInvented(const BlockKind& of_x, bool drop) {
  constexpr int kRows = 8;
  std::srand(4);
  const MatrixXd b = MatrixXd::Random(kRows, 3);
  const VectorXd c = VectorXd::Random(kRows);
  for (const MatrixXd& a : {DependentColumns(kRows), MatrixXd(MatrixXd::Zero(kRows, 3)),
                            MatrixXd(MatrixXd::Random(kRows, 3))}) {
    std::array<double, 3> x{}, y{};
    std::vector<Term> terms;
    terms.push_back(
        {std::make_unique<LinearResidual>(of_x, a, b, c), nullptr, {y.data(), x.data()}});
    const Prior prior =
        Marginalize(terms, Prior(), drop ? std::vector<double*>{x.data()} : std::vector<double*>{});
    ASSERT_EQ(prior.blocks, std::vector<double*>{y.data()});

    MatrixXd scaled = a;
    for (int k = 0; k < 3; ++k) scaled.col(k) /= std::max(a.col(k).norm(), 1e-300);
    const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeThinU);
    const Eigen::Index rank = (svd.singularValues().array() > 1e-9).count();
    const MatrixXd u = svd.matrixU().leftCols(rank);
    const MatrixXd off = MatrixXd::Identity(kRows, kRows) - u * u.transpose();
    const MatrixXd information = b.transpose() * off * b;
    EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - information).norm(), 1e-9) << rank;
    EXPECT_LT((prior.jacobian.transpose() * prior.residual + b.transpose() * off * c).norm(), 1e-9)
        << rank;
  }
}

TEST(MarginalizeRankDeficient, StatesTakeOnlyWhatSpeaksOfThem) {
  ExpectNothingLostOrInvented(BlockKind{3, 3}, true);
}

TEST(MarginalizeRankDeficient, PointsTakeOnlyWhatSpeaksOfThem) {
  ExpectNothingLostOrInvented(kPointKind, false);
}

}  // namespace
}  // namespace slcmap
