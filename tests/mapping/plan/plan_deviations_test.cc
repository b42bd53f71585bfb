#include "mapping/plan/plan_deviations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/testing/built_from_plan.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using testing::BuildFromPlan;
using testing::BuildOtherwise;
using testing::MadeStorey;
using testing::MakeOfficePlan;

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

TEST(PlanDeviations, AreReadAsTheyWereWritten) {
  const testing::TempFolder folder;
  PlanComparison comparison;
  comparison.plan = "floor.png", comparison.planned_storey = "S0", comparison.storey = 1;
  comparison.T_plan_world.translation = {1.5, -2.25, 0};
  comparison.agreeing_m = 30, comparison.differing_m = 2, comparison.rival_share = 0.25;
  comparison.walls = {{PlanStatus::kDeviates, 3, 4, {1, 2}, {3, 2}, 0.012, 0.004, 0.001, 0.002},
                      {PlanStatus::kMissing, 5, -1, {0, 0}, {2, 0}}};
  comparison.openings = {{PlanStatus::kAsPlanned, 0, 2, {1, 0}, {2, 0}, 0.003, 0.01, -0.004, 0.02}};
  WritePlanComparison(folder.Path(), comparison);
  const PlanComparison read = ReadPlanComparison(folder.Path());
  EXPECT_EQ(read.plan, "floor.png");
  EXPECT_EQ(read.storey, 1);
  EXPECT_LT((read.T_plan_world.translation - comparison.T_plan_world.translation).norm(), 1e-9);
  ASSERT_EQ(read.walls.size(), 2u);
  EXPECT_EQ(read.walls[0].status, PlanStatus::kDeviates);
  EXPECT_NEAR(read.walls[0].deviation_m, 0.012, 1e-9);
  EXPECT_EQ(read.walls[1].status, PlanStatus::kMissing);
  ASSERT_EQ(read.openings.size(), 1u);
  EXPECT_NEAR(read.openings[0].wider_m, -0.004, 1e-9);
  const std::string text = testing::ReadText(folder.Path("plan_deviations.csv"));
  EXPECT_THAT(text, ::testing::HasSubstr("wall,deviates,3,4,1.0000,2.0000,3.0000,2.0000,12.0,4.0"));
  EXPECT_THAT(text, ::testing::HasSubstr("wall,missing,5,-1"));
}

}  // namespace
}  // namespace slcmap
