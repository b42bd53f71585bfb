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

SurfacesBeside Beside(double left_deg, double right_deg, double right_off_m = 0) {
  std::vector<DensePoint> cloud;
  AddHalfPlane(left_deg, 0, true, &cloud);
  AddHalfPlane(right_deg, right_off_m, false, &cloud);
  return LineSurfaces(cloud).Beside(kLine, kMetre);
}

TEST(LineSurfaces, APlaneOnBothSidesIsFlat) {
  EXPECT_NEAR(Beside(0, 180).flat_m, 1, 1e-9);
  EXPECT_NEAR(Beside(60, 240).flat_m, 1, 1e-9);
}

TEST(LineSurfaces, ACreaseAStepAndAnEndAreNotFlat) {
  EXPECT_NEAR(Beside(0, 90).relief_m, 1, 1e-9);
  EXPECT_NEAR(Beside(0, 150).relief_m, 1, 1e-9);
  EXPECT_NEAR(Beside(0, 180, 0.08).relief_m, 1, 1e-9);
  std::vector<DensePoint> end;
  AddHalfPlane(0, 0, true, &end);
  EXPECT_NEAR(LineSurfaces(end).Beside(kLine, kMetre).relief_m, 1, 1e-9);
}

TEST(LineSurfaces, ALeafOfADoorIsFlatWhateverIsAtItsBack) {
  std::vector<DensePoint> cloud;
  AddHalfPlane(0, 0, true, &cloud);
  AddHalfPlane(180, 0, false, &cloud);
  AddHalfPlane(0, -0.05, false, &cloud);
  AddHalfPlane(180, -0.05, true, &cloud);
  EXPECT_NEAR(LineSurfaces(cloud).Beside(kLine, kMetre).flat_m, 1, 1e-9);
}

TEST(LineSurfaces, AFlatOneIsSoBesideAThingThatStandsOnItElsewhere) {
  const auto with_thing_at = [](double beside_m) {
    std::vector<DensePoint> cloud;
    AddHalfPlane(0, 0, true, &cloud);
    AddHalfPlane(180, 0, false, &cloud);
    std::vector<DensePoint> thing;
    AddHalfPlane(90, 0, false, &thing);
    for (DensePoint& point : thing) point.p_world.y() += beside_m;
    cloud.insert(cloud.end(), thing.begin(), thing.end());
    return LineSurfaces(cloud).Beside(kLine, kMetre);
  };
  EXPECT_NEAR(with_thing_at(0.08).flat_m, 1, 1e-9);
  EXPECT_NEAR(with_thing_at(0).relief_m, 1, 1e-9) << "it stands at the line";
}

TEST(LineSurfaces, FarFromAllPointsNothingIsKnown) {
  std::vector<DensePoint> cloud;
  AddHalfPlane(0, 1, true, &cloud);
  EXPECT_NEAR(LineSurfaces(cloud).Beside(kLine, kMetre).unknown_m, 1, 1e-9);
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
  joint.sides = {-12, 4};
  EXPECT_LT(ComputeEdgeProbability(joint), 0.2);
}

TEST(LineKinds, EachVoteCounts) {
  const TrackedLine line = WithStep(25, 0.6, {0.6, 0.4, 0});
  const double before = ComputeEdgeProbability(line);
  TrackedLine bent = line, behind = line, strong = line, joint = line, loose = line;
  bent.surfaces = {0.1, 0.9, 0};
  behind.sides = {20, 5};
  strong.step_sum *= 2, strong.lasting_sum *= 2;
  joint.parallels = 6;
  loose.fit.spread_px = 0.4;
  EXPECT_GT(ComputeEdgeProbability(bent), before);
  EXPECT_GT(ComputeEdgeProbability(behind), before);
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

TEST(LineTexture, ThoseInOnePlaneCount) {
  std::vector<TrackedLine> courses;
  for (const double y_m : {0.0, 0.1, 0.2, 0.3, -0.1, -0.2}) {
    courses.push_back(Along(y_m, 0, -1, 1));
  }
  EXPECT_EQ(ParallelsOfFirst(courses), 5);
  std::swap(courses[0], courses[3]);
  EXPECT_EQ(ParallelsOfFirst(courses), 3) << "within reach of the one at the rim";
}

TEST(LineTexture, ThePlaneWithMostCounts) {
  std::vector<TrackedLine> corner = {Along(0, 0, -1, 1),   Along(0.1, 0, -1, 1),
                                     Along(0.2, 0, -1, 1), Along(0, 0.1, -1, 1),
                                     Along(0, 0.2, -1, 1), Along(0, 0.3, -1, 1)};
  EXPECT_EQ(ParallelsOfFirst(corner), 3);
}

TEST(LineTexture, WhatIsFarAwayElsewhereAlongOrTurnedDoesNotCount) {
  EXPECT_EQ(ParallelsOfFirst({Along(0, 0, -1, 1), Along(0.5, 0, -1, 1)}), 0);
  EXPECT_EQ(ParallelsOfFirst({Along(0, 0, -1, 1), Along(0.1, 0, 1.5, 3)}), 0);
  std::vector<TrackedLine> crossing = {Along(0, 0, -1, 1), Along(0.1, 0, -1, 1)};
  crossing[1].line.direction_world = Eigen::Vector3d(1, 0.3, 0).normalized();
  EXPECT_EQ(ParallelsOfFirst(crossing), 0);
}

TEST(LineTexture, OneLineInPiecesIsOne) {
  EXPECT_EQ(
      ParallelsOfFirst({Along(0, 0, -1, 1), Along(0.1, 0, -1, 0.05), Along(0.105, 0, -0.05, 1)}),
      1);
}

TEST(LineTexture, MostOfALineDecides) {
  std::vector<TrackedLine> lines = {Along(0, 0, -1, 1)};
  for (const double y_m : {0.1, 0.2, 0.3, -0.1}) lines.push_back(Along(y_m, 0, 0.6, 1));
  EXPECT_EQ(ParallelsOfFirst(lines), 0) << "a long edge that passes bricks at its end";
  for (TrackedLine& line : lines) line.intervals = {{-0.9, 1}};
  EXPECT_EQ(ParallelsOfFirst(lines), 4);
}

TEST(LineTexture, OtherSegmentsOfTheRunDoNotCount) {
  std::vector<TrackedLine> lines = {Along(0, 0, -1, 1), Along(0.1, 0, -1, 1)};
  lines[1].segment = 1;
  EXPECT_EQ(ParallelsOfFirst(lines), 0);
}

}  // namespace
}  // namespace slcmap
