#include "mapping/plan/plan_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mapping/plan/plan_files.h"
#include "tests/testing/built_from_plan.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using testing::BuildFromPlan;
using testing::BuildOtherwise;
using ::testing::HasSubstr;
using testing::InventWalk;
using testing::MadeStorey;
using testing::MakeOfficePlan;

// How far a place of the map's walk comes to lie from where it was, at most.
double PlacedOff(const PlanPlacement& placement, const MadeStorey& made) {
  double most_m = 0;
  for (const Vector2d& p : made.storey.trajectory) {
    const Vector2d off = placement.T_plan_world * p - made.how.T_plan_world * p;
    most_m = std::max(most_m, off.norm());
  }
  return most_m;
}

std::string Refusal(const BuiltStorey& built, const BuildingPlan& plan,
                    const std::optional<RoughStart>& start = std::nullopt) {
  try {
    RequirePlacement(built, plan, FindPlacement(built, plan, start));
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

MadeStorey BuildOffice(unsigned seed, double length_m = 60) {
  const BuildingPlan plan = MakeOfficePlan();
  BuildOtherwise how;
  how.seed = seed;
  how.extra_walls = 2;
  how.T_plan_world.yaw_rad = 1.3 * seed;
  return BuildFromPlan(plan, InventWalk(plan, testing::kOfficeStart, length_m, seed), how);
}

TEST(PlanPlacement, PlacesAnOfficeHoweverItIsTurned) {
  const BuildingPlan plan = MakeOfficePlan();
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const MadeStorey made = BuildOffice(seed);
    EXPECT_EQ(Refusal(made.storey, plan), "") << seed;
    const auto placement = FindPlacement(made.storey, plan, std::nullopt);
    ASSERT_TRUE(placement) << seed;
    EXPECT_LT(PlacedOff(*placement, made), 0.03) << seed;
  }
}

TEST(PlanPlacement, TellsThatThePlanIsMirrored) {
  const MadeStorey made = BuildOffice(1);
  EXPECT_THAT(Refusal(made.storey, MirrorPlan(MakeOfficePlan())), HasSubstr("mirror the plan"));
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
  const std::string refusal = Refusal(BuildOffice(1).storey, other);
  EXPECT_THAT(refusal, HasSubstr("plan of another floor"));
  EXPECT_THAT(refusal, HasSubstr("% of what the map knows"));
}

TEST(PlanPlacement, RefusesWhereHardlyAnythingWasWalked) {
  MadeStorey made = BuildOffice(1);
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
  BuildOtherwise how;
  how.deviating_share = 0;
  how.T_plan_world = {0.3, {0, 0}};
  const MadeStorey made = BuildFromPlan(plan, {{11, 1}, {11.5, 1.2}, {13, 2}}, how);
  EXPECT_THAT(Refusal(made.storey, plan), HasSubstr("--plan-at"));
}

TEST(PlanPlacement, ARoughStartTellsWhichPlaceIsMeant) {
  BuildingPlan plan;
  for (int i = 0; i < 5; ++i) {
    const double x = 5.0 * i;
    AddFaces({{{x, 0}, {x + 4, 0}, {x + 4, 3}, {x, 3}}, {}}, true, &plan);
  }
  BuildOtherwise how;
  how.deviating_share = 0;
  how.T_plan_world = {0.3, {0, 0}};
  const MadeStorey made = BuildFromPlan(plan, {{11, 1}, {11.5, 1.2}, {13, 2}}, how);
  const RoughStart start{{0.8, -0.7, 0}, 0.2};
  EXPECT_EQ(Refusal(made.storey, plan, start), "");
  EXPECT_LT(PlacedOff(*FindPlacement(made.storey, plan, start), made), 0.02);
}

// Real floors, of which one has no walk.
TEST(PlanPlacement, PlacesWalksThroughRealFloors) {
  for (const auto& [name, at] :
       {std::pair("floor_2", Vector2d(44, 27)), std::pair("floor_3", Vector2d(10.8, 26.6))}) {
    const std::string path = testing::SharedData(std::string("plans/") + name + ".png");
    if (path.empty()) GTEST_SKIP() << "no floor plans in ../shared/data";
    const BuildingPlan plan = ReadPlans(path, 0.01)[0];
    BuildOtherwise how;
    how.extra_walls = 3;
    const MadeStorey made = BuildFromPlan(plan, InventWalk(plan, at, 60, 1), how);
    EXPECT_EQ(Refusal(made.storey, plan), "") << name;
    EXPECT_LT(PlacedOff(*FindPlacement(made.storey, plan, std::nullopt), made), 0.05) << name;
  }
}

}  // namespace
}  // namespace slcmap
