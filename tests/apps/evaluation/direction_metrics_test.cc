#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "apps/evaluation/edge_straightness.h"
#include "data/core/math.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

Vector3d Level(double deg) { return {std::cos(deg * kDegree), std::sin(deg * kDegree), 0}; }

const std::vector<WeightedDirection> kSquare = {{Level(0), 4},
                                                {Level(180), 2},
                                                {Level(90), 3},
                                                {Vector3d::UnitZ(), 2},
                                                {-Vector3d::UnitZ(), 1}};

TEST(DirectionMetrics, ASquareBuildingHasNoDispersion) {
  const auto metrics = MeasureDirections(kSquare, {});
  ASSERT_TRUE(metrics);
  EXPECT_NEAR(metrics->dispersion_deg, 0, 1e-6);
  EXPECT_NEAR(metrics->orthogonality_deg.value(), 0, 1e-6);
  EXPECT_NEAR(metrics->following, 1, 1e-12);
}

TEST(DirectionMetrics, DispersionIsTheWeightedAngle) {
  // Two equal weights 1 degree to either side of each axis.
  const auto metrics = MeasureDirections(
      {{Level(1), 1}, {Level(-1), 1}, {Level(91), 2}, {Level(89), 2}, {Vector3d::UnitZ(), 2}}, {});
  ASSERT_TRUE(metrics);
  EXPECT_NEAR(metrics->dispersion_deg, std::sqrt(6.0 / 8), 1e-6);
  EXPECT_NEAR(metrics->orthogonality_deg.value(), 0, 1e-6);
}

TEST(DirectionMetrics, AxesThatAreNotSquareAreTold) {
  const auto metrics =
      MeasureDirections({{Level(0), 1}, {Level(91), 1}, {Vector3d::UnitZ(), 1}}, {});
  ASSERT_TRUE(metrics);
  EXPECT_NEAR(metrics->orthogonality_deg.value(), 1, 1e-6);
  EXPECT_NEAR(metrics->dispersion_deg, 0.5 * std::sqrt(2.0 / 3), 1e-3);
}

TEST(DirectionMetrics, TheSameTurnedScoresTheSame) {
  std::vector<WeightedDirection> bent = kSquare;
  bent[0].direction = Level(0.7);
  bent[3].direction = Vector3d(0.01, 0.02, 1).normalized();
  const auto as_is = MeasureDirections(bent, {});
  const Eigen::AngleAxisd turn(0.9, Vector3d(0.2, 0.7, -0.4).normalized());
  for (WeightedDirection& d : bent) d.direction = turn * d.direction;
  const auto turned = MeasureDirections(bent, {});
  EXPECT_NEAR(turned->dispersion_deg, as_is->dispersion_deg, 1e-6);
  EXPECT_NEAR(turned->orthogonality_deg.value(), as_is->orthogonality_deg.value(), 1e-6);
}

TEST(DirectionMetrics, WhatFollowsNoAxisIsLeftOut) {
  std::vector<WeightedDirection> directions = kSquare;
  directions.push_back({Level(30), 4});
  const auto metrics = MeasureDirections(directions, {});
  EXPECT_NEAR(metrics->following, 0.75, 1e-12);
  EXPECT_NEAR(metrics->dispersion_deg, 0, 1e-6);
}

TEST(DirectionMetrics, WithoutARightAngleThereIsNothing) {
  EXPECT_FALSE(MeasureDirections({}, {}));
  EXPECT_FALSE(MeasureDirections({{Level(0), 1}, {Level(2), 1}}, {}));
}

}  // namespace
}  // namespace slcmap
