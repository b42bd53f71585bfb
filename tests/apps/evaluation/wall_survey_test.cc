#include "apps/evaluation/wall_survey.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "apps/evaluation/straightness_report.h"
#include "data/core/error.h"
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
  EXPECT_EQ(wall.gaps.size(), 3u);  // there is no place for 15 m
  EXPECT_NEAR(GapOf(Measured(Wall(10, Arc(-0.010, 10))), 10), 0.010, 0.001) << "a hollow";
}

TEST(WallSurvey, TheStraightWallRanksBeforeTheBentOne) {
  const SurveyedFace straight = Measured(Wall(10, Straight));
  for (const double length_m : {1.0, 4.0, 10.0}) EXPECT_LT(GapOf(straight, length_m), 1e-9);
  const SurveyedFace bent = Measured(Wall(10, Arc(0.010, 10)));
  EXPECT_GT(GapOf(bent, 10), GapOf(straight, 10) + 0.009);
  EXPECT_GT(bent.rms_m, straight.rms_m);
  SurveyedPoints wall = Wall(10, Straight);  // a few wild points bend nothing
  for (size_t i = 7; i < wall.points.size(); i += 29) wall.points[i].p_world.y() += 0.3;
  EXPECT_LT(GapOf(Measured(wall), 10), 0.001);
  const Eigen::Isometry3d lean(Eigen::AngleAxisd(0.2 * kDegree, Vector3d::UnitX()));
  EXPECT_NEAR(Measured(MovedWall(lean, Wall(4, Straight), 0)).lean_m.value(),
              2.75 * std::sin(0.2 * kDegree), 1e-6);  // that of a storey
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
  for (const double length_m : {1.0, 4.0, 10.0}) {
    EXPECT_NEAR(GapOf(turned, length_m), GapOf(as_is, length_m), 1e-6);
    EXPECT_NEAR(GapOf(resampled, length_m), GapOf(as_is, length_m), 0.0006);
  }
  EXPECT_NEAR(turned.lean_m.value(), 0, 1e-6);
}

// A room of 4 m x 3 m: the walls y = 0, y = 3, x = 0 and x = 4.
std::vector<SurveyedPoints> Room(double shift_m = 0, double turn_deg = 0) {
  return {Wall(4, Straight), MovedWall(Turn(180, {4, 3 + shift_m, 0}), Wall(4, Straight), 1),
          MovedWall(Turn(-90, {0, 3, 0}), Wall(3, Straight), 2),
          MovedWall(Turn(90 + turn_deg, {4, 0, 0}), Wall(3, Straight), 3)};
}

TEST(WallSurvey, DistancesAndAnglesOfARoomAreFoundAndDisplacedWallsAreWorse) {
  const Survey truth = SurveyWalls(Room(), kUp);
  ASSERT_EQ(truth.walls.size(), 4u);
  ASSERT_EQ(truth.distances.size(), 2u);
  EXPECT_NEAR(truth.distances[0].distance_m, 3, 1e-9);
  EXPECT_NEAR(truth.distances[1].distance_m, 4, 1e-9);
  ASSERT_EQ(truth.angles.size(), 4u);
  EXPECT_NEAR(truth.angles[0].off_deg, 0, 1e-9);
  const SurveySummary right = Summarize(truth, &truth);
  const SurveySummary wrong = Summarize(SurveyWalls(Room(0.02, 0.5), kUp), &truth);
  EXPECT_NEAR(right.distance_error_95_m.value(), 0, 1e-9);
  EXPECT_NEAR(wrong.distance_error_95_m.value(), 0.02, 0.003);
  EXPECT_NEAR(wrong.angle_worst_deg, 0.5, 1e-6);
  EXPECT_EQ(right.angles_within, 4);
  EXPECT_LT(wrong.angles_within, 4);
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

TEST(WallSurvey, GapsOfAProfileWithHolesAreNotGuessed) {
  std::vector<ProfilePlace> profile;
  for (int i = 0; i <= 40; ++i) {
    if (i < 5 || i > 35) profile.push_back({0.25 * i, 0, 0});
  }
  EXPECT_FALSE(GapUnder_m(profile, 10, 0.25));
  EXPECT_TRUE(GapUnder_m(profile, 1, 0.25));
}

TEST(MapWalls, OnlyPointsOfTheFaceAreSurveyed) {
  Building building;
  BuildingPlane plane;
  plane.kind = PlaneKind::kWall;
  plane.normal = Vector3d::UnitY();
  plane.outline_world = {{0, 0, 0}, {10, 0, 0}, {10, 0, 2.4}, {0, 0, 2.4}};
  building.planes = {plane};
  PlanWall of_plan;
  of_plan.id = 7;
  of_plan.plane_ids = {3, plane.id};
  building.walls = {of_plan};
  std::vector<DensePoint> cloud;
  for (const PlacedInWorld& p : Wall(10, Arc(0.01, 10)).points) {
    cloud.push_back({p.p_world, Vector3d::UnitY(), 0.002, 0});
  }
  const size_t on_wall = cloud.size();
  DensePoint other = cloud.front();
  other.normal_world = -Vector3d::UnitY();  // of the room behind
  cloud.push_back(other);
  other = cloud.front();
  other.p_world = {5, 0.2, 1};  // of furniture
  cloud.push_back(other);
  const auto walls = WallsOfMap(building, cloud);
  ASSERT_EQ(walls.size(), 1u);
  EXPECT_EQ(walls[0].points.size(), on_wall);
  EXPECT_EQ(walls[0].wall, 7);  // its number in plans
  EXPECT_NEAR(GapOf(Measured(walls[0]), 10), 0.010, 0.001);
}

TEST(BuildingTolerances, AreThoseOfTheStandards) {
  for (const auto& [length_m, gap_m] :
       {std::pair{0.1, 0.003}, {4.0, 0.010}, {7.0, 0.015}, {40.0, 0.025}}) {
    EXPECT_DOUBLE_EQ(AllowedGap_m(length_m), gap_m);
  }
  EXPECT_DOUBLE_EQ(AllowedAngle_m(2.5), 0.008);
  EXPECT_DOUBLE_EQ(AllowedWidth_m(3), 0.016);
  EXPECT_DOUBLE_EQ(AllowedWidth_m(99), 0.030);
  EXPECT_DOUBLE_EQ(BuildingFloor_m(10), 0.020);
  for (const auto& [error_m, level] : {std::pair{0.0009, "LOA50"},
                                       {0.004, "LOA40"},
                                       {0.015, "LOA30"},
                                       {0.02, "LOA20"},
                                       {0.2, "LOA10"}}) {
    EXPECT_EQ(LevelOfAccuracy(error_m), level);
  }
}

TEST(WallSurvey, OfNothingThereAreNoFigures) {
  const nlohmann::ordered_json json = MapStraightnessJson({})["survey"];
  for (const char* key : {"lean_median_m", "lean_worst_m", "distance_bound_95_median_m",
                          "angle_worst_deg", "distance_error_95_m"}) {
    EXPECT_EQ(json.at(key).dump(), "null") << key;
  }
  const MapStraightness one_wall{std::nullopt, SurveyWalls({Room().front()}, kUp)};
  const std::string table = MapStraightnessTable(one_wall);
  for (const char* part :
       {"distances 0 between faces, known to +-- mm (95 %, median): -\n", "at most - deg off 90"}) {
    EXPECT_NE(table.find(part), std::string::npos) << table;
  }
}

}  // namespace
}  // namespace slcmap
