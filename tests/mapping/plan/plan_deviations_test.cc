#include "mapping/plan/plan_deviations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "tests/testing/built_from_plan.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using testing::BuildFromPlan;
using testing::BuildOtherwise;
using testing::InventWalk;
using testing::MadeStorey;
using testing::MakeOfficePlan;

PlanComparison CompareMade(const MadeStorey& made, const BuildingPlan& plan) {
  const auto placement = FindPlacement(made.storey, plan, std::nullopt);
  EXPECT_TRUE(placement);
  return CompareWithPlan(made.storey, plan, placement.value_or(PlanPlacement{}));
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
    BuildOtherwise how;
    how.seed = seed;
    how.sigma_m = sigma_m;
    const MadeStorey made =
        BuildFromPlan(plan, InventWalk(plan, testing::kOfficeStart, 80, seed), how);
    std::map<int64_t, std::size_t> built;
    for (std::size_t i = 0; i < made.storey.faces.size(); ++i) {
      built[made.storey.faces[i].plane] = i;
    }
    for (const WallDeviation& wall : CompareMade(made, plan).walls) {
      if (wall.plane < 0) continue;
      const std::size_t i = built.at(wall.plane);
      if (static_cast<int64_t>(made.planned[i]) != wall.planned) continue;
      const double put_m = made.deviation_m[i];
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

TEST(PlanDeviations, TellsWhatIsMissingAndWhatIsNew) {
  const BuildingPlan plan = MakeOfficePlan();
  BuildOtherwise how;
  how.deviating_share = 0;
  how.missing_share = 0.15;
  how.extra_walls = 3;
  const MadeStorey made = BuildFromPlan(plan, InventWalk(plan, testing::kOfficeStart, 80, 2), how);
  ASSERT_FALSE(made.missing.empty());
  int missing = 0, missing_falsely = 0, added = 0, added_falsely = 0;
  for (const WallDeviation& wall : CompareMade(made, plan).walls) {
    if (wall.status == PlanStatus::kMissing) {
      const bool is = std::ranges::find(made.missing, static_cast<std::size_t>(wall.planned)) !=
                      made.missing.end();
      ++(is ? missing : missing_falsely);
    } else if (wall.status == PlanStatus::kNew) {
      const auto built = std::ranges::find_if(
          made.storey.faces, [&](const MappedFace& face) { return face.plane == wall.plane; });
      const bool is = made.planned[built - made.storey.faces.begin()] == plan.faces.size();
      ++(is ? added : added_falsely);
    }
  }
  EXPECT_GE(missing, static_cast<int>(made.missing.size()) / 2);
  EXPECT_LE(missing_falsely, 1);
  EXPECT_GE(added, 2);
  EXPECT_EQ(added_falsely, 0);
}

// One room with a door that is wider and elsewhere, in a wall that has another door too.
TEST(PlanDeviations, TellsOfOpenings) {
  const BuildingPlan plan = MakeOfficePlan();
  BuildOtherwise how;
  how.deviating_share = 0;
  MadeStorey made = BuildFromPlan(plan, InventWalk(plan, testing::kOfficeStart, 80, 3), how);
  ASSERT_GE(made.storey.openings.size(), 4u);
  PlannedOpening& door = made.storey.openings[1].opening;
  const Vector2d along = (door.end - door.start).normalized();
  door.start += 0.05 * along, door.end += 0.15 * along;
  int deviating = 0;
  for (const OpeningDeviation& opening : CompareMade(made, plan).openings) {
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
  std::ifstream table(folder.Path("plan_deviations.csv"));
  const std::string text(std::istreambuf_iterator<char>(table), {});
  EXPECT_THAT(text, ::testing::HasSubstr("wall,deviates,3,4,1.0000,2.0000,3.0000,2.0000,12.0,4.0"));
  EXPECT_THAT(text, ::testing::HasSubstr("wall,missing,5,-1"));
}

}  // namespace
}  // namespace slcmap
