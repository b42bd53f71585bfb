#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "mapping/pipes/outline_pairs.h"
#include "mapping/pipes/pipe_evidence.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

constexpr int kPairs = 40;
constexpr double kSigma_m = 0.0005, kPoseSigma_m = 0.002;

// How far a body reaches along a normal, on its first and its second side.
using Reach = std::function<double(const Vector2d& normal, int side)>;

// From directions within `spread_rad`, far away: both normals are the same. Poses are off by up to
// `pose_m`, each image by its own.
std::vector<OutlinePair> SelectPairs(const Reach& reach, double spread_rad, double pose_m = 0) {
  std::vector<OutlinePair> pairs;
  for (int i = 0; i < kPairs; ++i) {
    const double turn_rad = spread_rad * (static_cast<double>(i) / (kPairs - 1) - 0.5) + 0.4;
    const double off_m = pose_m * std::sin(7.0 * i);
    OutlinePair pair;
    pair.sigma_m = kSigma_m;
    for (int side = 0; side < 2; ++side) {
      pair.normals[side] = {-std::sin(turn_rad), std::cos(turn_rad)};
      pair.offsets_m[side] = reach(pair.normals[side], side) + off_m;
    }
    pairs.push_back(pair);
  }
  return pairs;
}

Reach FitCylinder(double radius_m, const Vector2d& place) {
  return [=](const Vector2d& normal, int side) {
    return normal.dot(place) + (side == 0 ? -radius_m : radius_m);
  };
}

Reach BarOf(double width_m, double depth_m, double turn_rad) {
  const Vector2d first(std::cos(turn_rad), std::sin(turn_rad)), second(-first.y(), first.x());
  return [=](const Vector2d& normal, int side) {
    const double half_m =
        0.5 * (std::abs(normal.dot(first)) * width_m + std::abs(normal.dot(second)) * depth_m);
    return side == 0 ? -half_m : half_m;
  };
}

bool IsPipe(const std::vector<OutlinePair>& pairs, double radius_m) {
  Cylinder cylinder;
  cylinder.radius_m = radius_m;
  return HasPipeWidth(cylinder, CollectWidthEvidence(pairs, radius_m, kPoseSigma_m), {});
}

TEST(WidthEvidence, ACylinderIsAsWideFromAllSides) {
  const auto pairs = SelectPairs(FitCylinder(0.03, {0.004, -0.002}), 0.8);
  const WidthEvidence widths = CollectWidthEvidence(pairs, 0.029, kPoseSigma_m);
  EXPECT_EQ(widths.images, kPairs);
  EXPECT_NEAR(widths.cylinder, 0, 1e-6);
  EXPECT_NEAR(widths.radius_m, 0.03, 1e-6);
  EXPECT_NEAR(widths.edges, widths.told, 1e-3);
  EXPECT_GT(widths.told, 40);
  EXPECT_GT(widths.bar, 5);
  EXPECT_TRUE(IsPipe(pairs, 0.029));
}

// Poses move both outlines.
TEST(WidthEvidence, HardlyHangsOnPoses) {
  EXPECT_TRUE(IsPipe(SelectPairs(FitCylinder(0.03, {0, 0}), 0.8, 0.003), 0.03));
}

TEST(WidthEvidence, EdgesAndBarsAreNoCylinders) {
  const Reach edges = [](const Vector2d& normal, int side) {
    return normal.dot(side == 0 ? Vector2d(-0.01, -0.03) : Vector2d(0.01, 0.03));
  };
  const auto of_edges = SelectPairs(edges, 0.8);
  const WidthEvidence widths = CollectWidthEvidence(of_edges, 0.03, kPoseSigma_m);
  EXPECT_NEAR(widths.edges, 0, 1e-6);
  EXPECT_GT(widths.cylinder, 40);
  EXPECT_FALSE(IsPipe(of_edges, 0.03));
  for (const double turn_rad : {0.0, 0.5}) {
    const auto of_bar = SelectPairs(BarOf(0.06, 0.05, turn_rad), 1.4);
    EXPECT_NEAR(CollectWidthEvidence(of_bar, 0.03, kPoseSigma_m).bar, 0, 0.1) << turn_rad;
    EXPECT_FALSE(IsPipe(of_bar, 0.03)) << turn_rad;
  }
}

TEST(WidthEvidence, ViewsFromOneDirectionTellNothing) {
  const auto pairs = SelectPairs(FitCylinder(0.03, {0, 0}), 0.1);
  EXPECT_LT(CollectWidthEvidence(pairs, 0.03, kPoseSigma_m).told, 1);
  EXPECT_FALSE(IsPipe(pairs, 0.03));
  EXPECT_EQ(CollectWidthEvidence({}, 0.03, kPoseSigma_m).images, 0);
}

TEST(WidthEvidence, WhatIsFlatInTheCloudIsNoPipe) {
  Cylinder cylinder;
  cylinder.radius_m = 0.1;
  const WidthEvidence widths =
      CollectWidthEvidence(SelectPairs(FitCylinder(0.1, {0, 0}), 0.8), 0.1, 0.002);
  EXPECT_TRUE(HasPipeWidth(cylinder, widths, {100, 0.8, 1.0, 0.1}));
  EXPECT_FALSE(HasPipeWidth(cylinder, widths, {100, 0.05, 0.2, 0.9}));
}

}  // namespace
}  // namespace slcmap
