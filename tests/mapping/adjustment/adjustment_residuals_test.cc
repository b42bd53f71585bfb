#include <gtest/gtest.h>

#include "mapping/adjustment/residuals.h"
#include "odometry/geometry/lines.h"
#include "tests/odometry/residuals/factor_test_utils.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kHeading_rad = 0.37;
const Vector3d kFirstAnchor(1, 2, 0.5), kSecondAnchor(-0.5, 1, 1.5), kOnEdge(3, -1, 2);

Eigen::VectorXd Residual(const Factor& factor, const std::vector<std::vector<double>>& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  Eigen::VectorXd residual(factor.rows());
  factor.Linearize(pointers.data(), residual.data(), nullptr);
  return residual;
}

TEST(FirstPoseResidual, TellsPositionAndHeadingOnly) {
  const RigidTransform first(ExpRotation({0.2, -0.4, 1.5}), {1, 2, 3});
  const FirstPoseResidual factor(first);
  EXPECT_LT(Residual(factor, {PoseBlockOf(first)}).norm(), 1e-9);
  // A turn about a level axis is no turn of the heading.
  const RigidTransform tilted(ExpRotation({1e-3, 0, 0}) * first.rotation, first.translation);
  EXPECT_LT(Residual(factor, {PoseBlockOf(tilted)}).norm(), 1e-6);
  const RigidTransform turned(ExpRotation({0, 0, 1e-3}) * first.rotation, first.translation);
  EXPECT_NEAR(Residual(factor, {PoseBlockOf(turned)})[3], 10, 1e-6);
  const RigidTransform other(ExpRotation({0.02, 0.01, -0.03}) * first.rotation, {1.1, 2, 2.9});
  ExpectJacobiansMatchDifferences(factor, {PoseBlockOf(other)}, 1e-6);
}

std::vector<double> StructuralBlock(LineAxis axis, const Vector3d& anchor, const Vector3d& on) {
  const auto block = StructuralLineThrough({axis, anchor}, kHeading_rad, on);
  return {block.begin(), block.end()};
}

TEST(SameEdgeResidual, IsTheDistanceAcrossTheAxis) {
  for (const LineAxis axis : {LineAxis::kX, LineAxis::kY, LineAxis::kVertical}) {
    const SameStructuralEdgeResidual factor(axis, kFirstAnchor, kSecondAnchor, 0.01);
    const Vector3d moved = kOnEdge + 0.7 * AxisDirection(axis, kHeading_rad) +
                           AxesAcross(axis, kHeading_rad) * Eigen::Vector2d(0.02, -0.03);
    std::vector<std::vector<double>> blocks{StructuralBlock(axis, kFirstAnchor, moved),
                                            StructuralBlock(axis, kSecondAnchor, kOnEdge)};
    if (axis != LineAxis::kVertical) blocks.insert(blocks.begin(), {kHeading_rad});
    EXPECT_LT((Residual(factor, blocks) - Eigen::Vector2d(2, -3)).norm(), 1e-9);
    ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
  }
}

TEST(LineDistanceResidual, TellsHowFarAwayALineIs) {
  constexpr double kSigma = 0.1;
  const std::vector<double> structural = StructuralBlock(LineAxis::kX, kFirstAnchor, kOnEdge);
  const LineDistanceResidual of_structural(kStructuralLineKind, structural.data(), kSigma);
  const std::vector<double> turned{structural[0] + 0.3, structural[1]};
  EXPECT_EQ(Residual(of_structural, {turned})[0], 0);
  const std::vector<double> nearer{structural[0], structural[1] + 0.2};
  EXPECT_NEAR(Residual(of_structural, {nearer})[0], 2, 1e-12);
  ExpectJacobiansMatchDifferences(of_structural, {nearer}, 1e-6);
  const auto general = GeneralLineThrough(kFirstAnchor, kOnEdge, Vector3d(0.2, -1, 0.1));
  const LineDistanceResidual of_general(kGeneralLineKind, general.data(), kSigma);
  const auto far = GeneralLineThrough(kFirstAnchor, kFirstAnchor + 3 * (kOnEdge - kFirstAnchor),
                                      Vector3d(0.2, -1, 0.1));
  const std::vector<double> block(far.begin(), far.end());
  EXPECT_NEAR(Residual(of_general, {block})[0], (far[4] - general[4]) / kSigma, 1e-12);
  ExpectJacobiansMatchDifferences(of_general, {block}, 1e-6);
}

TEST(SameEdgeResidual, OfFreeLinesIsTheDistanceAtAPlaceAlongThem) {
  const Vector3d direction = Vector3d(0.2, -1, 0.1).normalized();
  const auto block_of = [&](const Vector3d& anchor, const Vector3d& on) {
    const auto block = GeneralLineThrough(anchor, on, direction);
    return std::vector<double>(block.begin(), block.end());
  };
  const auto along = [&](const Vector3d& anchor) { return direction.dot(kOnEdge - anchor); };
  const Matrix32d across = AxesAcross(LineAxis::kY, kHeading_rad);
  const SameFreeEdgeResidual factor({kFirstAnchor, along(kFirstAnchor)},
                                    {kSecondAnchor, along(kSecondAnchor)}, across, 0.01);
  const Vector3d off(0.01, 0.002, -0.02);
  const std::vector<std::vector<double>> blocks{block_of(kFirstAnchor, kOnEdge + off),
                                                block_of(kSecondAnchor, kOnEdge)};
  const Vector3d across_line = off - direction * direction.dot(off);
  EXPECT_LT((Residual(factor, blocks) - 100 * across.transpose() * across_line).norm(), 1e-9);
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

}  // namespace
}  // namespace slcmap
