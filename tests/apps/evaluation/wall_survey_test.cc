#include "apps/evaluation/wall_survey.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "data/core/math.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d::UnitZ();

// How far a wall is off its plane at a place along it.
using Bend = std::function<double(double along_m)>;

// Bent as an arc whose middle is sag_m off the chord of length_m.
Bend Arc(double sag_m, double length_m) {
  return [=](double s) { return 4 * sag_m * s * (length_m - s) / (length_m * length_m); };
}
double Straight(double) { return 0; }

// The face y = 0 of x = 0 to length_m, 2.4 m high, seen from y > 0.
SurveyedPoints Wall(double length_m, const Bend& bend, double step_m = 0.1) {
  SurveyedPoints wall{0, {0.5 * length_m, 1, 1}, {}};
  for (double x = 0; x <= length_m + 1e-9; x += step_m) {
    for (double z = 0; z <= 2.4; z += 0.2) {
      wall.points.push_back({{x, bend(x), z}, Eigen::Matrix3d::Zero()});
    }
  }
  return wall;
}

SurveyedPoints MovedWall(const Eigen::Isometry3d& motion, SurveyedPoints wall, int64_t id) {
  wall.wall = id;
  wall.seen_from_world = motion * wall.seen_from_world;
  for (PlacedInWorld& p : wall.points) p.p_world = motion * p.p_world;
  return wall;
}

Eigen::Isometry3d Turn(double yaw_deg, const Vector3d& shift) {
  return Eigen::Translation3d(shift) * Eigen::AngleAxisd(yaw_deg * kDegree, kUp);
}

double GapOf(const SurveyedFace& wall, double length_m) {
  for (const StraightedgeGap& gap : wall.gaps) {
    if (gap.length_m == length_m) return gap.gap_m;
  }
  ADD_FAILURE() << "no straightedge of " << length_m << " m";
  return -1;
}

SurveyedFace Measured(const SurveyedPoints& wall) { return SurveyWalls({wall}, kUp).walls.at(0); }

TEST(WallSurvey, TenMillimetresOverTenMetresAreReportedAsSuch) {
  const SurveyedFace wall = Measured(Wall(10, Arc(0.010, 10)));
  EXPECT_NEAR(GapOf(wall, 10), 0.010, 0.001);
  EXPECT_NEAR(GapOf(wall, 4), 0.0016, 0.0003);
  EXPECT_EQ(Measured(Wall(9, Straight)).gaps.size(), 1u);  // there is no place for 10 m
  EXPECT_NEAR(GapOf(Measured(Wall(10, Arc(-0.010, 10))), 10), 0.010, 0.001) << "a hollow";
}

TEST(WallSurvey, TheStraightWallRanksBeforeTheBentOne) {
  const SurveyedFace straight = Measured(Wall(10, Straight));
  for (const double length_m : {4.0, 10.0}) EXPECT_LT(GapOf(straight, length_m), 1e-9);
  const SurveyedFace bent = Measured(Wall(10, Arc(0.010, 10)));
  EXPECT_GT(GapOf(bent, 10), GapOf(straight, 10) + 0.009);
  SurveyedPoints wall = Wall(10, Straight);  // a few wild points bend nothing
  for (size_t i = 7; i < wall.points.size(); i += 29) wall.points[i].p_world.y() += 0.3;
  EXPECT_LT(GapOf(Measured(wall), 10), 0.001);
}

TEST(WallSurvey, TheSameTurnedOrResampledScoresTheSame) {
  const SurveyedPoints bent = Wall(10, Arc(0.010, 10));
  const SurveyedFace as_is = Measured(bent);
  // Of any direction: the vertical is turned with it.
  const Eigen::Isometry3d turn = Eigen::Translation3d(3, -8, 1) *
                                 Eigen::AngleAxisd(2.1, Vector3d(0.5, 0.1, -0.7).normalized());
  const SurveyedFace turned =
      SurveyWalls({MovedWall(turn, bent, 0)}, turn.rotation() * kUp).walls.at(0);
  const SurveyedFace resampled = Measured(Wall(10, Arc(0.010, 10), 0.037));
  for (const double length_m : {4.0, 10.0}) {
    EXPECT_NEAR(GapOf(turned, length_m), GapOf(as_is, length_m), 1e-6);
    EXPECT_NEAR(GapOf(resampled, length_m), GapOf(as_is, length_m), 0.0006);
  }
}

// A room of 4 m x 3 m: the walls y = 0, y = 3, x = 0 and x = 4.
std::vector<SurveyedPoints> Room(double shift_m = 0, double turn_deg = 0) {
  return {Wall(4, Straight), MovedWall(Turn(180, {4, 3 + shift_m, 0}), Wall(4, Straight), 1),
          MovedWall(Turn(-90, {0, 3, 0}), Wall(3, Straight), 2),
          MovedWall(Turn(90 + turn_deg, {4, 0, 0}), Wall(3, Straight), 3)};
}

TEST(WallSurvey, DistancesOfARoomAreFoundAndDisplacedWallsAreWorse) {
  const Survey truth = SurveyWalls(Room(), kUp);
  ASSERT_EQ(truth.walls.size(), 4u);
  ASSERT_EQ(truth.distances.size(), 2u);
  EXPECT_NEAR(truth.distances[0].distance_m, 3, 1e-9);
  EXPECT_NEAR(truth.distances[1].distance_m, 4, 1e-9);
  EXPECT_NEAR(DistanceError95_m(truth, truth).value(), 0, 1e-9);
  EXPECT_NEAR(DistanceError95_m(SurveyWalls(Room(0.02, 0.5), kUp), truth).value(), 0.02, 0.003);
  EXPECT_FALSE(DistanceError95_m(SurveyWalls({Room().front()}, kUp), truth));
  EXPECT_FALSE(WorstGap_m(truth, 10));
  EXPECT_LT(WorstGap_m(truth, 4).value(), 1e-9);
}

TEST(WallSurvey, WhatPosesBentIsToldApartFromWhatIsBent) {
  SurveyedPoints truth = Wall(10, Arc(0.015, 10)), mapped = truth;
  // Each point has its own place before the wall, the same in both: noise of the observations.
  for (size_t i = 0; i < truth.points.size(); ++i) {
    const double noise_m = 0.02 * std::sin(37.0 * static_cast<double>(i));
    truth.points[i].p_world.y() += noise_m;
    mapped.points[i].p_world.y() += noise_m + Arc(0.010, 10)(mapped.points[i].p_world.x());
  }
  mapped = MovedWall(Turn(40, {1, 2, 0}), mapped, 0);
  const auto added = BendsAdded({mapped}, {truth}, kUp);
  ASSERT_EQ(added.size(), 1u);
  EXPECT_NEAR(GapOf(Measured(added[0]), 10), 0.010, 0.001);
  EXPECT_LT(GapOf(Measured(BendsAdded({truth}, {truth}, kUp)[0]), 10), 1e-9);
  EXPECT_TRUE(BendsAdded({Wall(4, Straight)}, {truth}, kUp).empty());
}

TEST(WallSurvey, ToleratesGapsAsTheStandardDoes) {
  for (const auto& [length_m, gap_m] :
       {std::pair{0.1, 0.003}, {4.0, 0.010}, {7.0, 0.015}, {40.0, 0.025}}) {
    EXPECT_DOUBLE_EQ(AllowedGap_m(length_m), gap_m);
  }
}

TEST(WallSurvey, GapsOfAProfileWithHolesAreNotGuessed) {
  std::vector<ProfilePlace> profile;
  for (int i = 0; i <= 40; ++i) {
    if (i < 5 || i > 35) profile.push_back({0.25 * i, 0});
  }
  EXPECT_FALSE(GapUnder_m(profile, 10, 0.25));
  EXPECT_TRUE(GapUnder_m(profile, 1, 0.25));
}

}  // namespace
}  // namespace slcmap
