// Lines of all kinds, with points that belong to them, in the solver and in the prior.
#include "tests/odometry/window/lines_in_window.h"

#include "odometry/window/marginalization.h"
#include "odometry/window/solver.h"

namespace slcmap {
namespace {

TEST_F(LinesInWindow, TheSolverFindsHeadingLinesAndPoints) {
  const auto structural = structural_;
  const auto general = general_;
  heading_[0] += 0.02;
  for (int k = 0; k < 3; ++k) {
    structural_[k][0] += 0.05;
    structural_[k][1] *= 1.2;
    points_[k][2] *= 0.9;
  }
  const double delta[] = {0.03, -0.04, 0.02, 0.03};
  BlockPlus(kGeneralLineKind, general.data(), delta, general_.data());
  const SolverSummary summary =
      Solve(&terms_, Prior(), [&](const double* block) { return IsPose(block); },
            {.max_iterations = 30, .function_tolerance = 1e-12});
  ASSERT_TRUE(summary.usable);
  EXPECT_LT(summary.final_cost, 1e-8);
  EXPECT_NEAR(heading_[0], 0.2, 1e-6);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(structural_[k][0], structural[k][0], 1e-5);
    EXPECT_NEAR(structural_[k][1], structural[k][1], 1e-5);
  }
  Eigen::Vector4d off;
  BlockMinus(kGeneralLineKind, general_.data(), general.data(), off.data());
  EXPECT_LT(off.norm(), 1e-5);
}

// Neither the heading nor the lines may teach the prior where the world is or how it is turned.
TEST_F(LinesInWindow, ThePriorKnowsNeitherHeadingNorPosition) {
  const Prior prior = Marginalize(terms_, Prior(), {poses_[0].data(), structural_[0].data()});
  // Three poses, the heading, two structural lines, a general one, the cameras.
  ASSERT_EQ(prior.blocks.size(), 8u);
  ASSERT_GT(prior.jacobian.norm(), 1);
  constexpr double kStep = 1e-6;
  for (int freedom = 0; freedom < 4; ++freedom) {
    const double yaw = freedom == 3 ? kStep : 0;
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    if (freedom < 3) shift[freedom] = kStep;
    const RigidTransform by(ExpRotation({0, 0, yaw}), shift);
    Eigen::VectorXd all(prior.TangentTotal());
    for (size_t k = 0; k < prior.blocks.size(); ++k) {
      all.segment(prior.TangentOffset(static_cast<int>(k)), prior.kinds[k].tangent_size) =
          Moved(prior.blocks[k], prior.kinds[k], by, yaw) / kStep;
    }
    EXPECT_LT((prior.jacobian * all).norm(), 1e-4 * prior.jacobian.norm()) << "freedom " << freedom;
  }
}

}  // namespace
}  // namespace slcmap
