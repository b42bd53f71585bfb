#include "tests/odometry/residuals/line_residuals_by_definition.h"

namespace slcmap {
namespace {

TEST(AlongAxisResidual, IsTheAngleOffTheAxisInStandardDeviations) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const Matrix32d across = AxesAcross(axis, kHeading);
    const Vector3d direction =
        AxisDirection(axis, kHeading) + 1e-3 * across.col(0) - 2e-3 * across.col(1);
    Blocks blocks{FreeLineBlocks(scene, direction)[1]};
    if (axis != LineAxis::kVertical) blocks.insert(blocks.begin(), {kHeading});
    const Eigen::VectorXd r = Residual(AlongAxisResidual(axis, 1e-3), blocks);
    EXPECT_LT((r - Vector2d(1, -2)).norm(), 1e-4);
    blocks.insert(std::prev(blocks.end()), {3e-3, 1e-3});
    const Eigen::VectorXd own = Residual(AlongAxisResidual(axis, 1e-3, true), blocks);
    EXPECT_LT((own - Vector2d(-2, -3)).norm(), 1e-4) << "beside what it shares";
  }
}

TEST(AlongAxisResidual, WhatIsSharedHasJacobiansAsDifferencesHaveThem) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    Blocks blocks{{2e-3, -1e-3}, FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1]};
    if (axis != LineAxis::kVertical) blocks.insert(blocks.begin(), {kHeading});
    ExpectJacobiansMatchDifferences(AlongAxisResidual(axis, 0.01, true), blocks, 1e-6);
  }
  ExpectJacobiansMatchDifferences(SharedDeviationResidual(0.01), {{2e-3, -1e-3}}, 1e-6);
}

TEST(AlongAxisResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const AlongAxisResidual factor(axis, 0.01);
    auto* by_definition = new AlongAxisByDefinition{axis, 0.01};
    const std::vector<double> line = FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1];
    if (axis == LineAxis::kVertical) {
      const ceres::AutoDiffCostFunction<AlongAxisByDefinition, 2, 5> twin(by_definition);
      ExpectSameAsTwin(factor, twin, {line});
    } else {
      const ceres::AutoDiffCostFunction<AlongAxisByDefinition, 2, 1, 5> twin(by_definition);
      ExpectSameAsTwin(factor, twin, {{kHeading}, line});
    }
  }
}

const std::vector<double> kSlope = {0.7, 0.5};

TEST(AlongSlopeResidual, IsTheAngleOffTheSlopeInStandardDeviations) {
  const LineScene scene;
  const Matrix32d across = AxesAcrossSlope(kSlope.data());
  const Vector3d direction =
      SlopeDirection(kSlope.data()) + 1e-3 * across.col(0) - 2e-3 * across.col(1);
  EXPECT_LT(std::abs(across.col(0).z()), 1e-12) << "the first one is level";
  const Eigen::VectorXd r =
      Residual(AlongSlopeResidual(1e-3), {kSlope, FreeLineBlocks(scene, direction)[1]});
  EXPECT_LT((r - Vector2d(1, -2)).norm(), 1e-4);
}

TEST(AlongSlopeResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  const ceres::AutoDiffCostFunction<AlongSlopeByDefinition, 2, 2, 5> twin(
      new AlongSlopeByDefinition{0.01});
  ExpectSameAsTwin(AlongSlopeResidual(0.01), twin,
                   {kSlope, FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1]});
}

}  // namespace
}  // namespace slcmap
