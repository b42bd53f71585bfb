#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mapping/lines/line_store.h"

namespace slcmap {
namespace {

DirectedLine Level(double heading_deg, double length_m) {
  const double angle = heading_deg * M_PI / 180;
  return {{std::cos(angle), std::sin(angle), 0}, length_m, 0.002};
}

double Heading_deg(const BuildingAxis& axis) {
  return std::atan2(axis.direction_world.y(), axis.direction_world.x()) * 180 / M_PI;
}

TEST(BuildingAxes, OfABuildingAreThoseThatItsLinesShare) {
  const std::vector<DirectedLine> lines = {
      Level(20, 6), Level(110, 4), Level(-160, 3), Level(55, 1), {{0, 0, -1}, 8, 0.001}};
  const auto axes = FindAxes(lines);
  ASSERT_EQ(axes.size(), 3u);
  EXPECT_EQ(axes[0].axis, LineAxis::kVertical);
  EXPECT_EQ(axes[1].axis, LineAxis::kX);
  EXPECT_NEAR(Heading_deg(axes[1]), 20, 0.1);
  EXPECT_NEAR(Heading_deg(axes[2]), 110, 0.1);
}

TEST(BuildingAxes, OfAWingTurnedByTwelveDegreesAreItsOwn) {
  const auto axes = FindAxes({Level(0, 12), Level(90, 9), Level(12, 8), Level(102, 5)});
  ASSERT_EQ(axes.size(), 5u);
  EXPECT_NEAR(Heading_deg(axes[1]), 0, 0.1);
  EXPECT_NEAR(Heading_deg(axes[3]), 12, 0.1);
  EXPECT_EQ(axes[3].world, 1);
}

TEST(BuildingAxes, OfAFurnishedRoomAreNotWhatAnyHeadingHas) {
  std::vector<DirectedLine> lines = {Level(20, 60), Level(44, 40)};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any_deg(0, 180);
  for (int i = 0; i < 800; ++i) lines.push_back(Level(any_deg(random), 1));
  const auto axes = FindAxes(lines);
  ASSERT_EQ(axes.size(), 5u);
  EXPECT_NEAR(Heading_deg(axes[1]), 20, 0.2);
  EXPECT_NEAR(Heading_deg(axes[3]), 44, 0.2);
}

TEST(BuildingAxes, TheVerticalIsThatOfTheLinesWhereThereAreSome) {
  const Eigen::Vector3d leaning = Eigen::Vector3d(0.03, 0, 1).normalized();
  const auto axes = FindAxes({{leaning, 9, 0.001}, {-leaning, 9, 0.001}}), none = FindAxes({});
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT(axes[0].direction_world.cross(leaning).norm(), 1e-9);
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(none[0].direction_world, Eigen::Vector3d::UnitZ());
}

TEST(BuildingAxes, OfARunLeaveOutWhatWasWithdrawn) {
  OdometryRun run;
  run.line_deviation_rad = 0.003;
  run.manhattan_worlds = {{.heading_rad = 0.1}, {.heading_rad = 0.5, .withdrawn = true}};
  const auto axes = AxesOfRun(run, 0.0005);
  ASSERT_EQ(axes.size(), 3u);
  EXPECT_EQ(axes[1].world, 0);
  // Lines may be farther off than the run has learned.
  EXPECT_NEAR(axes[1].sigma_rad, 1.4 * 0.003, 1e-12);
  run.line_deviation_rad = 0;
  EXPECT_EQ(AxesOfRun(run, 0.0005)[1].sigma_rad, 0.0005);
}

}  // namespace
}  // namespace slcmap
