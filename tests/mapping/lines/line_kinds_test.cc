#include "mapping/lines/line_kinds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping/lines/line_store.h"

namespace slcmap {
namespace {

const PointAndDirection kLine = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()};
const std::vector<Interval> kMetre = {{-0.5, 0.5}};

// Points every 4 cm of a half plane that ends at the line, `degrees` from the world's y, moved by
// `off_m` along z; alternately 5 mm off it. Seen from where its angle grows to, or from the other
// side.
void AddHalfPlane(double degrees, double off_m, bool from_above, std::vector<DensePoint>* cloud) {
  const double angle = degrees * M_PI / 180, sense = from_above ? 1 : -1;
  for (int x = -18; x <= 18; ++x) {
    for (int k = 0; k < 8; ++k) {
      const double beside_m = 0.02 + 0.04 * k;
      DensePoint point;
      point.p_world = {0.04 * x, beside_m * std::cos(angle),
                       beside_m * std::sin(angle) + off_m + (k % 2 == 0 ? 0.005 : -0.005)};
      point.normal_world = {0, -sense * std::sin(angle), sense * std::cos(angle)};
      point.sigma_m = 0.005;
      cloud->push_back(point);
    }
  }
}

struct HalfPlane {
  double degrees, off_m;
  bool from_above;
  double beside_m = 0;  // the line, where it starts
};

SurfacesBeside Beside(const std::vector<HalfPlane>& planes) {
  std::vector<DensePoint> cloud;
  for (const HalfPlane& plane : planes) {
    const size_t first = cloud.size();
    AddHalfPlane(plane.degrees, plane.off_m, plane.from_above, &cloud);
    for (size_t i = first; i < cloud.size(); ++i) cloud[i].p_world.y() += plane.beside_m;
  }
  return LineSurfaces(cloud).Beside(kLine, kMetre);
}

TEST(LineSurfaces, AreFlatWhereAPlaneIsOnBothSides) {
  const HalfPlane left{0, 0, true}, right{180, 0, false};
  for (const auto& [what, planes] : std::vector<std::pair<const char*, std::vector<HalfPlane>>>{
           {"a plane", {left, right}},
           {"a sloping one", {{60, 0, true}, {240, 0, false}}},
           {"a leaf of a door, whatever is at its back",
            {left, right, {0, -0.05, false}, {180, -0.05, true}}},
           {"a thing stands on it elsewhere", {left, right, {90, 0, false, 0.08}}}}) {
    EXPECT_NEAR(Beside(planes).flat_m, 1, 1e-9) << what;
  }
  for (const auto& [what, planes] : std::vector<std::pair<const char*, std::vector<HalfPlane>>>{
           {"a crease", {left, {90, 0, false}}},
           {"a blunt one", {left, {150, 0, false}}},
           {"a step", {left, {180, 0.08, false}}},
           {"an end", {left}},
           {"a thing stands at the line", {left, right, {90, 0, false}}}}) {
    EXPECT_NEAR(Beside(planes).relief_m, 1, 1e-9) << what;
  }
}

TEST(LineSurfaces, FarFromAllPointsNothingIsKnown) {
  EXPECT_NEAR(Beside({{0, 1, true}}).unknown_m, 1, 1e-9);
  EXPECT_NEAR(LineSurfaces({}).Beside(kLine, {{0, 0.4}, {1, 1.3}}).unknown_m, 0.7, 1e-9);
}

// As well known as most lines.
TrackedLine WithStep(double step, double lasting, const SurfacesBeside& surfaces) {
  TrackedLine line;
  line.brightness_sum = 1000;
  line.step_sum = 10 * step;
  line.lasting_sum = 10 * step * lasting;
  line.surfaces = surfaces;
  line.fit.views = 12;
  line.fit.spread_px = 0.15;
  line.fit.covariance.setIdentity();
  line.fit.covariance *= 4e-6;
  return line;
}

TEST(LineKinds, WhereSurfacesBendIsAnEdgeAndAmongManyAJoint) {
  EXPECT_GT(ComputeEdgeProbability(WithStep(40, 1, {0.1, 0.9, 0})), 0.8);
  TrackedLine joint = WithStep(15, 0.2, {1, 0, 0});
  joint.parallels = 8;
  EXPECT_LT(ComputeEdgeProbability(joint), 0.2);
}

TEST(LineKinds, EachVoteCounts) {
  const TrackedLine line = WithStep(25, 0.6, {0.6, 0.4, 0});
  const double before = ComputeEdgeProbability(line);
  TrackedLine bent = line, strong = line, joint = line, loose = line;
  bent.surfaces = {0.1, 0.9, 0};
  strong.step_sum *= 2, strong.lasting_sum *= 2;
  joint.parallels = 6;
  loose.fit.spread_px = 0.4;
  EXPECT_GT(ComputeEdgeProbability(bent), before);
  EXPECT_GT(ComputeEdgeProbability(strong), before);
  EXPECT_LT(ComputeEdgeProbability(joint), before);
  EXPECT_LT(ComputeEdgeProbability(loose), before);
}

TEST(LineKinds, HowBrightTheLightIsDoesNotMatter) {
  const TrackedLine line = WithStep(25, 0.6, {0.6, 0.4, 0});
  TrackedLine dark = line;
  for (double* sum : {&dark.step_sum, &dark.lasting_sum, &dark.brightness_sum}) *sum *= 0.2;
  EXPECT_DOUBLE_EQ(ComputeEdgeProbability(dark), ComputeEdgeProbability(line));
}

TEST(LineKinds, ALineOfWhichNothingIsKnownHasAProbability) {
  const double probability = ComputeEdgeProbability(TrackedLine());
  EXPECT_GE(probability, 0);
  EXPECT_LE(probability, 1);
}

// A line along x through a place across it.
TrackedLine Along(double y_m, double z_m, double from_m, double to_m) {
  TrackedLine line;
  line.line = {{0, y_m, z_m}, Eigen::Vector3d::UnitX()};
  line.intervals = {{from_m, to_m}};
  line.seen = {from_m, to_m};
  return line;
}

int ParallelsOfFirst(std::vector<TrackedLine> lines) {
  CountParallels(0.4, &lines);
  return lines.front().parallels;
}

TEST(LineKinds, AboveACreaseIsTheTopOfASkirtingUnlessItIsOneOfManyJoints) {
  const TrackedLine crease = [] {
    TrackedLine line = Along(0, 0, -1, 0);
    line.surfaces = {0, 1, 0};
    return line;
  }();
  const auto trim = [&](const TrackedLine& first) {
    std::vector<TrackedLine> lines = {first, crease};
    CountParallels(0.4, &lines);
    return lines.front().trim;
  };
  EXPECT_NEAR(trim(Along(0, 0.08, -1, 0)), 1, 1e-9);
  EXPECT_NEAR(trim(Along(0, 0.08, -1, 1)), 0.5, 0.06) << "along a half of it";
  EXPECT_EQ(trim(Along(0, 0.3, -1, 0)), 0) << "higher than skirtings are";
  EXPECT_EQ(trim(Along(0, -0.08, -1, 0)), 0) << "beneath it";
  EXPECT_EQ(trim(Along(0.08, 0, -1, 0)), 0) << "on the floor before it";

  TrackedLine top = WithStep(5, 0.6, {0.6, 0.4, 0});
  const double before = ComputeEdgeProbability(top);
  top.trim = 1;
  EXPECT_GT(ComputeEdgeProbability(top), before + 0.3);
  top.parallels = 8;
  EXPECT_LT(ComputeEdgeProbability(top), before + 0.1);
}

std::vector<TrackedLine> AtHeights(const std::vector<double>& y_m, double from_m, double to_m) {
  std::vector<TrackedLine> lines = {Along(0, 0, -1, 1)};
  for (const double y : y_m) lines.push_back(Along(y, 0, from_m, to_m));
  return lines;
}

TEST(LineTexture, CountsThoseBesideMostOfALineInOnePlane) {
  const std::vector<double> four = {0.1, 0.2, 0.3, -0.1};
  std::vector<TrackedLine> at_rim = AtHeights({0.1, 0.2, 0.3, -0.1, -0.2}, -1, 1);
  EXPECT_EQ(ParallelsOfFirst(at_rim), 5);
  std::swap(at_rim[0], at_rim[3]);
  EXPECT_EQ(ParallelsOfFirst(at_rim), 3) << "within reach";
  EXPECT_EQ(ParallelsOfFirst(AtHeights(four, 0.6, 1)), 0) << "an edge that passes bricks";
  EXPECT_EQ(ParallelsOfFirst(AtHeights(four, -0.9, 1)), 4);
  EXPECT_EQ(ParallelsOfFirst(AtHeights({0.5}, -1, 1)), 0) << "far away";
  EXPECT_EQ(ParallelsOfFirst(AtHeights({0.1}, 1.5, 3)), 0) << "elsewhere along it";
  EXPECT_EQ(
      ParallelsOfFirst({Along(0, 0, -1, 1), Along(0.1, 0, -1, 0.05), Along(0.105, 0, -0.05, 1)}), 1)
      << "one in pieces";
  std::vector<TrackedLine> corner = AtHeights({0.1, 0.2}, -1, 1);
  for (const double z_m : {0.1, 0.2, 0.3}) corner.push_back(Along(0, z_m, -1, 1));
  EXPECT_EQ(ParallelsOfFirst(corner), 3) << "the plane with most";
}

TEST(LineTexture, WhatIsTurnedOrOfAnotherSegmentDoesNotCount) {
  std::vector<TrackedLine> crossing = AtHeights({0.1}, -1, 1), other = crossing;
  EXPECT_EQ(ParallelsOfFirst(crossing), 1);
  crossing[1].line.direction_world = Eigen::Vector3d(1, 0.3, 0).normalized();
  EXPECT_EQ(ParallelsOfFirst(crossing), 0);
  other[1].segment = 1;
  EXPECT_EQ(ParallelsOfFirst(other), 0);
}

}  // namespace
}  // namespace slcmap
