#include "odometry/window/marginalization.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

// Dense normal equations of terms and prior over all blocks, states first: the straightforward way.
struct Dense {
  std::vector<double*> blocks;
  std::vector<int> offsets;
  Eigen::MatrixXd h;
  Eigen::VectorXd b;

  int OffsetOf(const double* block) const {
    return offsets[std::find(blocks.begin(), blocks.end(), block) - blocks.begin()];
  }
};

Dense NormalEquations(const std::vector<Term>& terms, const Prior& prior) {
  Dense dense;
  int total = 0;
  const auto meet = [&](double* block, const BlockKind& kind) {
    if (std::find(dense.blocks.begin(), dense.blocks.end(), block) != dense.blocks.end()) return;
    dense.blocks.push_back(block);
    dense.offsets.push_back(total);
    total += kind.tangent_size;
  };
  for (size_t k = 0; k < prior.blocks.size(); ++k) meet(prior.blocks[k], prior.kinds[k]);
  for (const Term& term : terms) {
    for (int k = 0; k < term.factor->blocks(); ++k) {
      meet(term.blocks[k], term.factor->kind(k));
    }
  }
  dense.h.setZero(total, total);
  dense.b.setZero(total);
  const auto add = [&](const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
    dense.h += j.transpose() * j;
    dense.b += j.transpose() * r;
  };
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(prior.residual.size(), total);
  int column = 0;
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    const int size = prior.kinds[k].tangent_size;
    j.middleCols(dense.OffsetOf(prior.blocks[k]), size) = prior.jacobian.middleCols(column, size);
    column += size;
  }
  std::vector<const double*> at(prior.blocks.begin(), prior.blocks.end());
  add(j, prior.residual + prior.jacobian * prior.Difference(at.data()));
  for (const Term& term : terms) {
    const Factor& factor = *term.factor;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::vector<RowMajor> parts;
    std::array<double*, Factor::kMaxBlocks> outputs{};
    for (int k = 0; k < factor.blocks(); ++k) {
      parts.emplace_back(factor.rows(), factor.tangent_size(k));
    }
    for (int k = 0; k < factor.blocks(); ++k) outputs[k] = parts[k].data();
    Eigen::VectorXd r(factor.rows());
    factor.Linearize(term.blocks.data(), r.data(), outputs.data());
    double rho[3] = {0, 1, 0};
    if (term.loss) term.loss->Evaluate(r.squaredNorm(), rho);
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(factor.rows(), total);
    for (int k = 0; k < factor.blocks(); ++k) {
      row.middleCols(dense.OffsetOf(term.blocks[k]), factor.tangent_size(k)) += parts[k];
    }
    add(std::sqrt(rho[1]) * row, std::sqrt(rho[1]) * r);
  }
  return dense;
}

TEST(Marginalize, IsTheSchurComplementOfTheNormalEquations) {
  SimulatedRunOptions options;
  options.duration_s = 5;
  options.stand_still_s = 0;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.5;
  options.odometry.points.max_points = 30;
  options.odometry.window.max_keyframes = 5;
  bool checked = false;
  RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
    SlidingWindow* window = estimator->mutable_window();
    if (checked || window->empty() || window->state().frames.size() < 5) return;
    WindowState* state = window->mutable_state();
    if (!state->frames[1]->pose_linearization) return;  // the prior is to be a real one
    checked = true;
    const std::vector<Term> terms = BuildTerms(state, window->model());
    FrameState& oldest = *state->frames.front();
    const Prior prior =
        Marginalize(terms, state->prior, {oldest.pose.data(), oldest.speed_bias.data()});

    const Dense dense = NormalEquations(terms, state->prior);
    std::vector<int> kept, dropped;
    for (size_t k = 0; k < prior.blocks.size(); ++k) {
      const int offset = dense.OffsetOf(prior.blocks[k]);
      for (int d = 0; d < prior.kinds[k].tangent_size; ++d) kept.push_back(offset + d);
    }
    for (int i = 0; i < dense.h.rows(); ++i) {
      if (std::find(kept.begin(), kept.end(), i) == kept.end()) dropped.push_back(i);
    }
    const Eigen::MatrixXd gain = dense.h(dropped, dropped).ldlt().solve(dense.h(dropped, kept));
    const Eigen::MatrixXd h = dense.h(kept, kept) - dense.h(kept, dropped) * gain;
    const Eigen::VectorXd b = dense.b(kept) - gain.transpose() * dense.b(dropped);

    const Eigen::MatrixXd h_prior = prior.jacobian.transpose() * prior.jacobian;
    std::vector<const double*> at(prior.blocks.begin(), prior.blocks.end());
    const Eigen::VectorXd b_prior = prior.jacobian.transpose() *
                                    (prior.residual + prior.jacobian * prior.Difference(at.data()));
    EXPECT_LT((h_prior - h).norm(), 1e-6 * h.norm());
    EXPECT_LT((b_prior - b).norm(), 1e-5 * (b.norm() + std::sqrt(h.norm())));
  });
  EXPECT_TRUE(checked);
}

}  // namespace
}  // namespace slcmap
