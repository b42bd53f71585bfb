#include "apps/evaluation/straightness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "data/core/error.h"
#include "data/core/math.h"
#include "tests/testing/edge_walk.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using testing::RunOver;
using testing::Walk;

const std::vector<PlySegment> kEdges = testing::WalkEdges();

std::vector<EdgeObservation> ObservationsOver(const Trajectory& walk) {
  return ObservationsOfRun(RunOver(walk), {}).edges;
}

// The same, but that what comes after the first half is moved.
Trajectory WithJump(Trajectory walk, const Vector3d& jump_m) {
  for (size_t i = walk.size() / 2; i < walk.size(); ++i) {
    walk[i].T_world_imu.translation += jump_m;
  }
  return walk;
}

Trajectory Turned(const RigidTransform& turn, Trajectory walk) {
  for (StampedPose& pose : walk) pose.T_world_imu = turn * pose.T_world_imu;
  return walk;
}

const RigidTransform kTurn = {
    Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(0.3, -0.5, 0.8).normalized())), {4, -7, 2}};

TEST(EdgeStraightness, WithTruePosesEdgesAreThin) {
  const Trajectory walk = Walk(20);
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), walk);
  EXPECT_EQ(result.edges, 4);
  EXPECT_EQ(result.observations, 80);
  EXPECT_LT(result.thickness_m, 1e-9);
  ASSERT_EQ(result.lines.size(), 4u);
  EXPECT_NEAR(std::abs(result.lines[0].direction_world.z()), 1, 1e-9);
  EXPECT_NEAR(result.lines[0].length_m, 1.1, 1e-6);
}

// A jump of 10 mm in the middle puts each observation 5 mm from the line through all.
TEST(EdgeStraightness, AJumpMakesEdgesAsThickAsItIs) {
  const Trajectory walk = Walk(20);
  const EdgeStraightness result =
      RetriangulateEdges(ObservationsOver(walk), WithJump(walk, {0, 0.01, 0}));
  EXPECT_NEAR(result.lines[0].thickness_m, 0.005 * std::sqrt(2.0), 0.0025);
  EXPECT_GT(result.thickness_m, 0.003);
  EXPECT_LT(result.thickness_m, 0.008);
}

TEST(EdgeStraightness, DriftShowsBetweenObservationsThatAreLongApart) {
  const Trajectory walk = Walk(60);  // 30 s
  Trajectory drifting = walk;
  for (size_t i = 0; i < drifting.size(); ++i) {
    drifting[i].T_world_imu.translation.y() += 0.001 * static_cast<double>(i);
  }
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), drifting);
  ASSERT_EQ(result.gaps.size(), 5u);
  EXPECT_LT(result.gaps[0].apart_m, 0.003);
  EXPECT_GT(result.gaps[3].apart_m, 0.02);
  for (size_t i = 0; i + 2 < result.gaps.size(); ++i) {
    EXPECT_LT(result.gaps[i].apart_m, result.gaps[i + 1].apart_m);
  }
  EXPECT_EQ(result.gaps[4].pairs, 0);
  EXPECT_TRUE(std::isinf(result.gaps[4].to_s));
}

TEST(EdgeStraightness, TheSameTurnedOrMoreOfTheSameScoresTheSame) {
  const Trajectory walk = Walk(40), bent = WithJump(walk, {0, 0.01, 0.003});
  const auto observations = ObservationsOver(walk);
  const EdgeStraightness as_is = RetriangulateEdges(observations, bent);
  const EdgeStraightness turned = RetriangulateEdges(observations, Turned(kTurn, bent));
  EXPECT_NEAR(turned.thickness_m, as_is.thickness_m, 1e-9);
  EXPECT_NEAR(turned.gaps[2].apart_m, as_is.gaps[2].apart_m, 1e-9);
  Trajectory half;
  for (size_t i = 0; i < walk.size(); i += 2) half.push_back(walk[i]);
  const EdgeStraightness few =
      RetriangulateEdges(ObservationsOver(half), WithJump(half, {0, 0.01, 0.003}));
  EXPECT_NEAR(few.thickness_m, as_is.thickness_m, 0.1 * as_is.thickness_m);
}

TEST(EdgeStraightness, ObservationsWithoutAPoseAreCounted) {
  const Trajectory walk = Walk(20);
  const Trajectory half(walk.begin(), walk.begin() + 10);
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), half);
  EXPECT_EQ(result.observations, 40);
  EXPECT_EQ(result.without_pose, 40);
  // Only what all have a pose for is seen by all.
  const ReferenceObservations all = ObservationsOfRun(RunOver(walk), {});
  EXPECT_EQ(SeenByAll(all, {&walk, &half}).edges.size(), 40u);
}

TEST(EdgeStraightness, WhatIsSeenOfAnotherThingIsLeftOut) {
  const Trajectory walk = Walk(20);
  std::vector<EdgeObservation> observations = ObservationsOver(walk);
  observations[4].edge = 2;  // is of edge 0, 1.7 m away
  const auto kept = OfOneEdge(observations, walk);
  EXPECT_EQ(kept.size(), observations.size() - 1);
  EXPECT_LT(RetriangulateEdges(kept, walk).thickness_m, 1e-9);
}

TEST(ReferenceObservations, ALineThatTheRunTookForTwoIsOneTrueEdge) {
  const Trajectory walk = Walk(20);
  std::vector<EdgeObservation> observations = ObservationsOver(walk);
  for (size_t i = 40; i < observations.size(); ++i) observations[i].edge += 100;
  EXPECT_EQ(RetriangulateEdges(observations, walk).edges, 8);
  const auto on_edges = OnTrueEdges(observations, walk, {kEdges, kEdges});
  EXPECT_EQ(on_edges.size(), observations.size());
  EXPECT_EQ(RetriangulateEdges(on_edges, walk).edges, 4);
}

TEST(ReferenceObservations, WhatLiesOnNoEdgeOrAsNearToTwoIsLeftOut) {
  const Trajectory walk = Walk(20);
  const std::vector<EdgeObservation> observations = ObservationsOver(walk);
  EXPECT_EQ(OnTrueEdges(observations, walk, {{kEdges[0]}, {}}).size(), 20u);
  PlySegment beside = kEdges[0];
  beside.start_world.x() += 0.004;  // in depth, which stereo knows worst
  beside.end_world.x() += 0.004;
  EXPECT_TRUE(OnTrueEdges(observations, walk, {{kEdges[0], beside}, {}}).empty());
}

TEST(ReferenceObservations, APlaceIsKnownWorstInDepth) {
  const auto observations = ObservationsOver(Walk(1));
  ASSERT_EQ(observations.size(), 4u);
  const Placed& end = observations[0].ends[0];
  EXPECT_NEAR(end.p_imu.z(), 2.6, 1e-9);
  // sqrt(2) 0.1 px of disparity at 2.6 m.
  EXPECT_NEAR(std::sqrt(end.covariance_m2(2, 2)), 2.6 * 2.6 * std::sqrt(2) * 0.1 / (450 * 0.11),
              0.003);
  EXPECT_LT(std::sqrt(end.covariance_m2(0, 0)), 0.006);
}

TEST(ReferenceObservations, LinesAlongTheBaselineAreLeftOut) {
  OdometryRun run = RunOver(Walk(1));
  run.keyframes[0].lines = {{0, {{100, 200}, {400, 200}}, LineSegment{{80, 200}, {380, 200}}}};
  const ReferenceObservations observations = ObservationsOfRun(run, {});
  EXPECT_TRUE(observations.edges.empty());
  EXPECT_EQ(observations.left_out, 1);
}

TEST(EdgeStraightness, OfNoObservationsThereIsNoThickness) {
  const EdgeStraightness nothing = RetriangulateEdges({}, {});
  EXPECT_TRUE(std::isnan(nothing.thickness_m));
  EXPECT_TRUE(std::isnan(ThicknessBeyond_m(nothing.thickness_m, nothing.thickness_m)));
  EXPECT_TRUE(std::isnan(nothing.gaps.at(0).apart_m));
  EXPECT_DOUBLE_EQ(ThicknessBeyond_m(0.005, 0.003), 0.004);
  EXPECT_EQ(ThicknessBeyond_m(0.003, 0.005), 0);
}

Vector3d Level(double deg) { return {std::cos(deg * kDegree), std::sin(deg * kDegree), 0}; }

const std::vector<WeightedDirection> kSquare = {{Level(0), 4},
                                                {Level(180), 2},
                                                {Level(90), 3},
                                                {Vector3d::UnitZ(), 2},
                                                {-Vector3d::UnitZ(), 1}};

TEST(DirectionMetrics, ASquareBuildingHasNoDispersion) {
  const auto metrics = MeasureDirections(kSquare);
  ASSERT_TRUE(metrics);
  EXPECT_NEAR(metrics->dispersion_deg, 0, 1e-6);
  EXPECT_NEAR(metrics->orthogonality_deg.value(), 0, 1e-6);
  EXPECT_NEAR(metrics->following, 1, 1e-12);
  // What follows no axis is left out; without a right angle there is nothing.
  std::vector<WeightedDirection> directions = kSquare;
  directions.push_back({Level(30), 4});
  EXPECT_NEAR(MeasureDirections(directions)->following, 0.75, 1e-12);
  EXPECT_NEAR(MeasureDirections(directions)->dispersion_deg, 0, 1e-6);
  EXPECT_FALSE(MeasureDirections({}));
  EXPECT_FALSE(MeasureDirections({{Level(0), 1}, {Level(2), 1}}));
}

TEST(DirectionMetrics, DispersionIsTheWeightedAngleAndAxesThatAreNotSquareAreTold) {
  // Two equal weights 1 degree to either side of each axis.
  const auto spread = MeasureDirections(
      {{Level(1), 1}, {Level(-1), 1}, {Level(91), 2}, {Level(89), 2}, {Vector3d::UnitZ(), 2}});
  ASSERT_TRUE(spread);
  EXPECT_NEAR(spread->dispersion_deg, std::sqrt(6.0 / 8), 1e-6);
  EXPECT_NEAR(spread->orthogonality_deg.value(), 0, 1e-6);
  const auto oblique = MeasureDirections({{Level(0), 1}, {Level(91), 1}, {Vector3d::UnitZ(), 1}});
  ASSERT_TRUE(oblique);
  EXPECT_NEAR(oblique->orthogonality_deg.value(), 1, 1e-6);
  EXPECT_NEAR(oblique->dispersion_deg, 0.5 * std::sqrt(2.0 / 3), 1e-3);
}

std::vector<Vector3d> Corner(double sigma_m, double apart_m, double step_m = 0.04) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, sigma_m);
  std::vector<Vector3d> points;
  int odd = 0;
  for (double a = 0; a < 2; a += step_m) {
    for (double b = 0; b < 2; b += step_m) {
      points.emplace_back(noise(random) + (++odd % 2) * apart_m, a, b);
      points.emplace_back(a, noise(random), b);
      points.emplace_back(a, b, noise(random));
    }
  }
  return points;
}

// Without the edges of the corner, where neighbourhoods reach over two faces.
constexpr double kSmallRadius_m = 0.15;

TEST(CloudFlatness, OrthogonalPlanesHaveTheVarianceOfTheirNoise) {
  const auto metrics = MeasureFlatness(Corner(0.003, 0), kSmallRadius_m);
  ASSERT_TRUE(metrics);
  ASSERT_TRUE(metrics->mom_m2);
  EXPECT_GT(metrics->on_planes, metrics->looked_at / 2);
  EXPECT_GT(*metrics->mom_m2, 8e-6);
  EXPECT_LT(metrics->mom_m2.value(), metrics->mpv_m2);
  // A wall that is there twice is less flat.
  const auto twice = MeasureFlatness(Corner(0.003, 0.01), kSmallRadius_m);
  EXPECT_GT(twice->mpv_m2, metrics->mpv_m2 + 5e-6);
  EXPECT_GT(*twice->mom_m2, *metrics->mom_m2 + 5e-6);
  EXPECT_GT(twice->mme, metrics->mme);
  EXPECT_FALSE(MeasureFlatness({}, 0.3));
  EXPECT_FALSE(MeasureFlatness({{0, 0, 0}, {5, 0, 0}}, 0.3));
}

TEST(CloudFlatness, TheSameTurnedOrThinnedScoresTheSame) {
  const auto as_is = MeasureFlatness(Corner(0.003, 0), kSmallRadius_m);
  std::vector<Vector3d> turned = Corner(0.003, 0), thinned;
  const Eigen::Isometry3d turn =
      Eigen::Translation3d(30, -20, 5) * Eigen::AngleAxisd(0.8, Vector3d(1, 2, 3).normalized());
  for (Vector3d& p : turned) p = turn * p;
  const auto after = MeasureFlatness(turned, kSmallRadius_m);
  EXPECT_NEAR(after->mpv_m2, as_is->mpv_m2, 0.01 * as_is->mpv_m2);
  EXPECT_NEAR(after->mme, as_is->mme, 0.01);
  EXPECT_NEAR(*after->mom_m2, *as_is->mom_m2, 0.03 * *as_is->mom_m2);
  std::mt19937 random(2);
  for (const Vector3d& p : turned) {
    if (random() % 2 == 0) thinned.push_back(p);
  }
  const auto few = MeasureFlatness(thinned, kSmallRadius_m);
  // Near the edges of the corner other neighbourhoods count as planes.
  EXPECT_NEAR(few->mpv_m2, as_is->mpv_m2, 0.1 * as_is->mpv_m2);
  EXPECT_NEAR(*few->mom_m2, *as_is->mom_m2, 0.15 * *as_is->mom_m2);
}

}  // namespace
}  // namespace slcmap
