#include "mapping/adjustment/adjustment_problem.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <set>

#include "data/core/error.h"
#include "mapping/adjustment/closure_terms.h"
#include "mapping/adjustment/residuals.h"
#include "odometry/geometry/lines.h"
#include "tests/odometry/residuals/factor_test_utils.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Ties two numbers.
class Difference final : public ceres::SizedCostFunction<1, 1, 1> {
 public:
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = x[0][0] - x[1][0] - 1;
    if (jacobians && jacobians[0]) jacobians[0][0] = 1;
    if (jacobians && jacobians[1]) jacobians[1][0] = -1;
    return true;
  }
};

// Places of a floor that each are tied to the next one north, and to the next one east by a point
// that both see, as rooms of a building that many visits hang together by; and what all see.
struct Floor {
  static constexpr size_t kSide = 20;

  Floor() : places(kSide * kSide), points(kSide * kSide) {
    for (size_t i = 0; i < places.size(); ++i) {
      Tie(&places[i], &common);
      Tie(&points[i], &places[i]);
      if (i % kSide + 1 < kSide) Tie(&points[i], &places[i + 1]);
      if (i + kSide < places.size()) Tie(&places[i], &places[i + kSide]);
    }
  }

  void Tie(double* a, double* b) { problem.AddResidualBlock(new Difference, nullptr, a, b); }

  std::vector<double*> First() {
    std::vector<double*> first;
    for (double& point : points) first.push_back(&point);
    return first;
  }

  ceres::Problem problem;
  std::vector<double> places, points;
  double common = 0;
};

// Numbers of the factor, by eliminating one place after the other.
size_t FillOf(Floor* floor, const ceres::ParameterBlockOrdering& ordering) {
  std::vector<std::set<size_t>> ties(floor->places.size());
  const auto tie = [&](size_t a, size_t b) {
    ties[a].insert(b);
    ties[b].insert(a);
  };
  for (size_t i = 0; i < ties.size(); ++i) {
    if (i % Floor::kSide + 1 < Floor::kSide) tie(i, i + 1);
    if (i + Floor::kSide < ties.size()) tie(i, i + Floor::kSide);
  }
  std::vector<size_t> order(ties.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](size_t i) { return ordering.GroupId(&floor->places[i]); });
  size_t fill = 0;
  for (const size_t i : order) {
    fill += ties[i].size() + 1;
    for (const size_t a : ties[i]) {
      ties[a].erase(i);
      for (const size_t b : ties[i]) {
        if (a != b) ties[a].insert(b);
      }
    }
  }
  return fill;
}

TEST(EliminationOrder, HasEachBlockOnceAndFillsLittle) {
  Floor floor;
  const auto ordering = EliminationOrder(floor.problem, floor.First(), {&floor.common});
  EXPECT_EQ(ordering->NumElements(), floor.problem.NumParameterBlocks());
  EXPECT_EQ(ordering->GroupSize(0), static_cast<int>(floor.points.size()));
  std::set<int> groups;
  for (double& place : floor.places) groups.insert(ordering->GroupId(&place));
  EXPECT_EQ(groups.size(), floor.places.size());
  EXPECT_GT(*groups.begin(), 0);
  EXPECT_GT(ordering->GroupId(&floor.common), *groups.rbegin());
  // Row by row the factor of a grid has as many numbers a place as a row has places.
  const size_t by_rows = floor.places.size() * Floor::kSide;
  EXPECT_LT(FillOf(&floor, *ordering), 0.6 * static_cast<double>(by_rows));
  std::vector<double*> first = floor.First();
  first.push_back(&floor.places[0]);
  EXPECT_THROW(EliminationOrder(floor.problem, first, {}), Error)
      << "two of a term are to be first";
}

// METIS has handlers of its own while it runs.
TEST(EliminationOrder, LeavesSignalsAsTheyWere) {
  struct sigaction mine {};
  mine.sa_handler = [](int) {};
  mine.sa_flags = SA_RESTART;
  struct sigaction before, after;
  sigaction(SIGTERM, &mine, &before);
  Floor floor;
  EliminationOrder(floor.problem, floor.First(), {&floor.common});
  sigaction(SIGTERM, &before, &after);
  EXPECT_EQ(after.sa_handler, mine.sa_handler);
  EXPECT_TRUE(after.sa_flags & SA_RESTART);
  EXPECT_FALSE(after.sa_flags & SA_RESETHAND);
}

TEST(EliminationOrder, OfPointsAloneIsThatOfPoints) {
  double points[2] = {};
  ceres::Problem problem;
  for (double& point : points) problem.AddParameterBlock(&point, 1);
  const auto ordering = EliminationOrder(problem, {&points[0], &points[1]}, {});
  EXPECT_EQ(ordering->NumElements(), 2);
  EXPECT_EQ(ordering->NumGroups(), 1);
}

struct Known {
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    residual[0] = x[0] / 2.0;
    return true;
  }
};

// All that is said of a block of two: as of the distance of a line that one image shows.
struct OneOfTwo {
  template <typename T>
  bool operator()(const T* x, const T* line, T* residual) const {
    residual[0] = x[0] + line[0] + 2.0 * line[1];
    return true;
  }
};

TEST(BlockCovariance, IsKnownBesideBlocksThatAreNot) {
  double x = 0.1;
  std::array<double, 2> line{0.3, -0.2};
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Known, 1, 1>(new Known), nullptr, &x);
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<OneOfTwo, 1, 1, 2>(new OneOfTwo),
                           nullptr, &x, line.data());
  const Eigen::MatrixXd of_x = BlockCovariance(&problem, {&x});
  ASSERT_EQ(of_x.size(), 1);
  EXPECT_NEAR(of_x(0, 0), 4, 1e-6);
  EXPECT_EQ(BlockCovariance(&problem, {line.data()}).size(), 0);
}

constexpr double kHeading_rad = 0.37;
const Vector3d kFirstAnchor(1, 2, 0.5), kSecondAnchor(-0.5, 1, 1.5), kOnEdge(3, -1, 2);

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

TEST(MeasuredPoint, HasTheJacobiansOfItsResidual) {
  const RigidTransform T_imu_camera(ExpRotation({0.3, -1.2, 0.7}), {0.05, -0.02, 0.1});
  const MeasuredPointResidual residual(T_imu_camera, {7, {1, -2, 3}, {0.005, 0.01, 0.02}});
  ExpectJacobiansMatchDifferences(residual,
                                  {PoseBlockOf({ExpRotation({0.2, 0.5, -0.9}), {2, 1, 1.5}}),
                                   {0.1, -0.3, 0.2, 0.4},
                                   {0.2, -0.1, 0.25}},
                                  1e-5);
}

TEST(KnownDistance, HasTheJacobiansOfItsResidual) {
  const RigidTransform T_imu_camera(ExpRotation({0.3, -1.2, 0.7}), {0.05, -0.02, 0.1});
  const DistanceTie tie{1, 2, 3.5, 0.003};
  const std::vector<double> near{0.2, -0.1, 0.25}, far{-0.3, 0.2, 0.1};
  ExpectJacobiansMatchDifferences(KnownDistanceResidual(T_imu_camera, tie, true), {near, far},
                                  1e-5);
  ExpectJacobiansMatchDifferences(
      KnownDistanceResidual(T_imu_camera, tie, false),
      {near, far, PoseBlockOf({ExpRotation({0.2, 0.5, -0.9}), {2, 1, 1}}),
       PoseBlockOf({ExpRotation({-0.4, 0.1, 0.3}), {0, 2, 1.5}})},
      1e-5);
}

}  // namespace
}  // namespace slcmap
