#include "mapping/plan/plan_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/plan/plan_deviations.h"
#include "mapping/plan/plan_files.h"
#include "tests/testing/built_from_plan.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using testing::BuildFromPlan;
using testing::BuildOtherwise;
using ::testing::HasSubstr;
using testing::MadeStorey;
using testing::MakeOfficePlan;

std::string Refusal(const BuiltStorey& built, const BuildingPlan& plan,
                    const std::optional<PlanPlacement>& placement) {
  return testing::MessageOf<DataError>([&] { RequirePlacement(built, plan, placement); });
}

std::string Refusal(const BuiltStorey& built, const BuildingPlan& plan) {
  return Refusal(built, plan, FindPlacement(built, plan, std::nullopt));
}

// It is placed, and no place of the map's walk comes to lie farther from where it was.
void ExpectPlaced(const MadeStorey& made, const BuildOtherwise& how, const BuildingPlan& plan,
                  double within_m, const std::optional<RoughStart>& start = std::nullopt) {
  const auto placement = FindPlacement(made.storey, plan, start);
  ASSERT_TRUE(placement);
  EXPECT_EQ(Refusal(made.storey, plan, placement), "");
  for (const Vector2d& p : made.storey.trajectory) {
    EXPECT_LT((placement->T_plan_world * p - how.T_plan_world * p).norm(), within_m);
  }
}

MadeStorey BuildOffice(const BuildOtherwise& how = {}) {
  return BuildFromPlan(MakeOfficePlan(true), testing::WalkThroughOffice(), how);
}

TEST(PlanPlacement, PlacesAnOfficeHoweverItIsTurned) {
  for (const unsigned seed : {1, 2}) {
    SCOPED_TRACE(seed);
    const BuildOtherwise how{.seed = seed, .T_plan_world = {1.3 * seed, {3, -2}}};
    ExpectPlaced(BuildOffice(how), how, MakeOfficePlan(), 0.03);
  }
}

TEST(PlanPlacement, TellsThatThePlanIsMirrored) {
  EXPECT_THAT(Refusal(BuildOffice().storey, StretchPlan(MakeOfficePlan(), {-1, 1})),
              HasSubstr("mirror the plan"));
}

TEST(PlanPlacement, TellsThatThePlanIsOfAnotherScale) {
  for (const double scale : {0.985, 1.02}) {
    SCOPED_TRACE(scale);
    EXPECT_THAT(Refusal(BuildOffice().storey, StretchPlan(MakeOfficePlan(), {scale, scale})),
                AllOf(HasSubstr("times as large"), HasSubstr("the plan's pixels")));
  }
}

// As windows are drawn: lines along the wall, 10 cm from each other, where walls seem to be too.
TEST(PlanPlacement, LinesBesideAWallDoNotDrawTheMapAside) {
  BuildingPlan plan = MakeOfficePlan();
  const std::vector<PlannedFace> walls = plan.faces;
  for (const PlannedFace& wall : walls) {
    for (const double behind_m : {0.1, 0.2}) {
      PlannedFace line = wall;
      line.start -= behind_m * wall.Normal(), line.end -= behind_m * wall.Normal();
      if (wall.Length() > 4) plan.faces.push_back(line);
    }
  }
  const BuildOtherwise how{.seed = 2, .T_plan_world = {0.7, {3, -2}}};
  ExpectPlaced(BuildOffice(how), how, plan, 0.03);
}

// Another floor: the same corridor between other rooms.
TEST(PlanPlacement, RefusesThePlanOfAnotherFloor) {
  BuildingPlan other;
  std::vector<Polygon> walls;
  for (int i = 0; i < 9; ++i) {
    const double x = 3.1 * i;
    walls.push_back({{{x, 0}, {x + 0.2, 0}, {x + 0.2, 9}, {x, 9}}, {}});
  }
  walls.push_back({{{0, 10.5}, {30, 10.5}, {30, 10.8}, {0, 10.8}}, {}});
  for (const Polygon& wall : walls) AddFaces(wall, false, &other);
  const std::string refusal = Refusal(BuildOffice().storey, other);
  EXPECT_THAT(refusal, HasSubstr("plan of another floor"));
  EXPECT_THAT(refusal, HasSubstr("% of what the map knows"));
}

TEST(PlanPlacement, RefusesWhereHardlyAnythingWasWalked) {
  MadeStorey made = BuildOffice();
  made.storey.faces.resize(2);
  EXPECT_THAT(Refusal(made.storey, MakeOfficePlan()), HasSubstr("walk more"));
}

// Rooms that are all alike: which one it is nobody can tell, but who was there.
TEST(PlanPlacement, RefusesWhatFitsInSeveralPlacesUnlessToldWhere) {
  BuildingPlan plan;
  for (int i = 0; i < 5; ++i) {
    const double x = 5.0 * i;
    AddFaces({{{x, 0}, {x + 4, 0}, {x + 4, 3}, {x, 3}}, {}}, true, &plan);
  }
  const BuildOtherwise how{.deviating_share = 0, .T_plan_world = {0.3, {0, 0}}};
  const MadeStorey made = BuildFromPlan(plan, {{11, 1}, {11.5, 1.2}, {13, 2}}, how);
  EXPECT_THAT(Refusal(made.storey, plan), HasSubstr("--plan-at"));
  ExpectPlaced(made, how, plan, 0.02, RoughStart{{0.8, -0.7, 0}, 0.2});
}

// Real floors, of which one has no walk.
TEST(PlanPlacement, PlacesWalksThroughRealFloors) {
  using Walk = std::vector<Vector2d>;
  for (const auto& [name, walk] : {std::pair("floor_2", Walk{{44, 27},
                                                             {44, 23.4},
                                                             {43.4, 23.2},
                                                             {19.4, 23.2},
                                                             {19, 22.8},
                                                             {13.8, 22.8},
                                                             {13.8, 22.4},
                                                             {10.6, 22.4},
                                                             {9.8, 20.4},
                                                             {25.8, 20.4}}),
                                   {"floor_3", Walk{{10.8, 26.8},
                                                    {10.8, 29.6},
                                                    {11, 29.8},
                                                    {26.6, 29.8},
                                                    {28, 30.4},
                                                    {14.4, 30.4},
                                                    {14, 30.8},
                                                    {14, 33},
                                                    {13.8, 28.4},
                                                    {12.8, 25},
                                                    {13, 22.8},
                                                    {15.4, 22.8}}}}) {
    SCOPED_TRACE(name);
    const std::string path = testing::SharedData(std::string("plans/") + name + ".png");
    if (path.empty()) GTEST_SKIP() << "no floor plans in ../shared/data";
    const BuildingPlan plan = ReadPlans(path, 0.01)[0];
    ExpectPlaced(BuildFromPlan(plan, walk, {}), {}, plan, 0.05);
  }
}

// From a place that is a little off.
PlanComparison CompareMade(const MadeStorey& made, const BuildingPlan& plan,
                           const BuildOtherwise& how) {
  PlanPlacement placement;
  placement.T_plan_world = {how.T_plan_world.yaw_rad + 0.001,
                            how.T_plan_world.shift + Vector2d(0.02, -0.015)};
  return CompareWithPlan(made.storey, plan, placement);
}

// Of all walls that were put elsewhere or stayed, how many were told.
struct Told {
  int put = 0, found = 0, stayed = 0, falsely = 0;
  double square_sum = 0;  // of errors over their standard deviations
};

Told CountTold(double sigma_m) {
  const BuildingPlan plan = MakeOfficePlan();
  Told told;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const BuildOtherwise how{.seed = seed, .sigma_m = sigma_m};
    const MadeStorey made = BuildFromPlan(plan, testing::WalkThroughOffice(), how);
    for (const WallDeviation& wall : CompareMade(made, plan, how).walls) {
      if (wall.plane < 0 || wall.plane != wall.planned) continue;
      const double put_m = made.deviation_m[static_cast<size_t>(wall.plane)];
      const bool deviates = wall.status == PlanStatus::kDeviates;
      ++(put_m == 0 ? told.stayed : told.put);
      if (put_m == 0) told.falsely += deviates;
      if (put_m != 0) told.found += deviates && put_m * wall.deviation_m > 0;
      told.square_sum += std::pow((wall.deviation_m - put_m) / wall.sigma_m, 2);
    }
  }
  return told;
}

TEST(PlanDeviations, FindsWallsThatAreNotWhereTheyWerePlanned) {
  const Told told = CountTold(0.0015);
  ASSERT_GT(told.put, 40);
  EXPECT_GE(told.found, 0.95 * told.put) << told.put;
  EXPECT_LE(told.falsely, 0.03 * told.stayed) << told.stayed;
}

TEST(PlanDeviations, StandardDeviationsAreHonest) {
  const Told told = CountTold(0.004);
  const double ratio = std::sqrt(told.square_sum / (told.put + told.stayed));
  EXPECT_GT(ratio, 0.7);
  EXPECT_LT(ratio, 1.3);
  EXPECT_LE(told.falsely, 0.04 * told.stayed) << told.stayed;
}

const BuildOtherwise kAsDrawn{.deviating_share = 0};

TEST(PlanDeviations, TellsWhatIsMissingAndWhatIsNew) {
  const MadeStorey made =
      BuildFromPlan(MakeOfficePlan(true), testing::WalkThroughOffice(), kAsDrawn);
  int missing = 0, added = 0;
  for (const WallDeviation& wall : CompareMade(made, MakeOfficePlan(), kAsDrawn).walls) {
    const Vector2d middle = 0.5 * (wall.start_plan + wall.end_plan);
    if (wall.status == PlanStatus::kMissing) {
      ++missing;
      EXPECT_NEAR(middle.x(), testing::kLackingWall.x(), 0.1) << middle.transpose();
    } else if (wall.status == PlanStatus::kNew) {
      ++added;
      EXPECT_TRUE(std::ranges::any_of(testing::kNewWalls, [&](const Vector2d& at) {
        return (middle - at).norm() < 0.3;
      })) << middle.transpose();
    }
  }
  EXPECT_EQ(missing, 2);  // sides
  EXPECT_GE(added, 2);
}

// Behind a door's leaf nothing is measured of the wall, which is as it was planned.
TEST(PlanDeviations, WhatWasNotMeasuredOfAPlannedWallIsNotNew) {
  MadeStorey made = BuildFromPlan(MakeOfficePlan(), testing::WalkThroughOffice(), kAsDrawn);
  for (MappedFace& face : made.storey.faces) {
    face.measured.assign(10, true);
    std::fill(face.measured.begin() + 3, face.measured.end(), false);
  }
  for (const WallDeviation& wall : CompareMade(made, MakeOfficePlan(), kAsDrawn).walls) {
    EXPECT_NE(wall.status, PlanStatus::kNew) << wall.start_plan.transpose();
  }
}

// A door that is wider and elsewhere, in a wall that has another door too.
TEST(PlanDeviations, TellsOfOpenings) {
  const BuildingPlan plan = MakeOfficePlan();
  MadeStorey made = BuildFromPlan(plan, testing::WalkThroughOffice(), kAsDrawn);
  ASSERT_GE(made.storey.openings.size(), 4u);
  PlannedOpening& door = made.storey.openings[1].opening;
  const Vector2d along = (door.end - door.start).normalized();
  door.start += 0.05 * along, door.end += 0.15 * along;
  int deviating = 0;
  for (const OpeningDeviation& opening : CompareMade(made, plan, kAsDrawn).openings) {
    if (opening.status != PlanStatus::kDeviates) continue;
    ++deviating;
    EXPECT_NEAR(std::abs(opening.moved_m), 0.1, 0.01);
    EXPECT_NEAR(opening.wider_m, 0.1, 0.01);
  }
  EXPECT_EQ(deviating, 1);
}

}  // namespace
}  // namespace slcmap
