#include "apps/evaluation/edge_straightness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/evaluation/straightness_report.h"
#include "data/core/error.h"
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
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), walk, {});
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
      RetriangulateEdges(ObservationsOver(walk), WithJump(walk, {0, 0.01, 0}), {});
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
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), drifting, {});
  ASSERT_EQ(result.gaps.size(), 5u);
  EXPECT_LT(result.gaps[0].apart_m, 0.003);
  EXPECT_GT(result.gaps[3].apart_m, 0.02);
  for (size_t i = 0; i + 2 < result.gaps.size(); ++i) {
    EXPECT_LT(result.gaps[i].apart_m, result.gaps[i + 1].apart_m);
  }
  EXPECT_EQ(result.gaps[4].pairs, 0);
  EXPECT_TRUE(std::isinf(result.gaps[4].to_s));
}

TEST(EdgeStraightness, TheSameTurnedScoresTheSame) {
  const Trajectory walk = Walk(20);
  const auto observations = ObservationsOver(walk);
  const Trajectory bent = WithJump(walk, {0, 0.004, 0.003});
  const EdgeStraightness as_is = RetriangulateEdges(observations, bent, {});
  const EdgeStraightness turned = RetriangulateEdges(observations, Turned(kTurn, bent), {});
  EXPECT_NEAR(turned.thickness_m, as_is.thickness_m, 1e-9);
  EXPECT_NEAR(turned.gaps[2].apart_m, as_is.gaps[2].apart_m, 1e-9);
}

TEST(EdgeStraightness, MoreOfTheSameObservationsScoreTheSame) {
  const Trajectory walk = Walk(40);
  Trajectory half;
  for (size_t i = 0; i < walk.size(); i += 2) half.push_back(walk[i]);
  const double all =
      RetriangulateEdges(ObservationsOver(walk), WithJump(walk, {0, 0.01, 0}), {}).thickness_m;
  const double few =
      RetriangulateEdges(ObservationsOver(half), WithJump(half, {0, 0.01, 0}), {}).thickness_m;
  EXPECT_NEAR(few, all, 0.1 * all);
}

TEST(EdgeStraightness, ObservationsWithoutAPoseAreCounted) {
  const Trajectory walk = Walk(20);
  const Trajectory half(walk.begin(), walk.begin() + 10);
  const EdgeStraightness result = RetriangulateEdges(ObservationsOver(walk), half, {});
  EXPECT_EQ(result.observations, 40);
  EXPECT_EQ(result.without_pose, 40);
}

TEST(EdgeStraightness, WhatIsSeenOfAnotherThingIsLeftOut) {
  const Trajectory walk = Walk(20);
  std::vector<EdgeObservation> observations = ObservationsOver(walk);
  observations[4].edge = 2;  // is of edge 0, 1.7 m away
  const auto kept = OfOneEdge(observations, walk, {});
  EXPECT_EQ(kept.size(), observations.size() - 1);
  EXPECT_LT(RetriangulateEdges(kept, walk, {}).thickness_m, 1e-9);
}

TEST(ReferenceObservations, ALineThatTheRunTookForTwoIsOneTrueEdge) {
  const Trajectory walk = Walk(20);
  std::vector<EdgeObservation> observations = ObservationsOver(walk);
  for (size_t i = 40; i < observations.size(); ++i) observations[i].edge += 100;
  EXPECT_EQ(RetriangulateEdges(observations, walk, {}).edges, 8);
  const auto on_edges = OnTrueEdges(observations, walk, {kEdges, kEdges});
  EXPECT_EQ(on_edges.size(), observations.size());
  EXPECT_EQ(RetriangulateEdges(on_edges, walk, {}).edges, 4);
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

TEST(ReferenceObservations, OnlyWhatAllHaveAPoseForIsSeenByAll) {
  const Trajectory walk = Walk(20), half(walk.begin(), walk.begin() + 10);
  const ReferenceObservations all = ObservationsOfRun(RunOver(walk), {});
  EXPECT_EQ(SeenByAll(all, {&walk, &half}).edges.size(), 40u);
}

TEST(EdgeStraightness, AbsurdOptionsAreRefused) {
  EdgeStraightnessOptions options;
  options.times_s = {3, 1};
  EXPECT_THROW(options.Check(), ConfigError);
  options = {};
  options.min_observations = 0;
  EXPECT_THROW(RetriangulateEdges({}, {}, options), ConfigError);
}

TEST(EdgeStraightness, OfNoObservationsThereIsNoThickness) {
  Straightness nothing;
  nothing.edges = RetriangulateEdges({}, {}, {});
  const StraightnessOptions options;
  const nlohmann::ordered_json json = StraightnessJson(nothing, &nothing, options)["edges"];
  EXPECT_EQ(json["thickness_m"].dump(), "null");
  EXPECT_EQ(json["thickness_beyond_true_poses_m"].dump(), "null");
  EXPECT_EQ(json["apart_by_time"][0]["apart_m"].dump(), "null");
  EXPECT_EQ(StraightnessTable(nothing, &nothing, options).find("edges     none with"), 0u);
}

}  // namespace
}  // namespace slcmap
