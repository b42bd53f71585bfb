#include "mapping/lines/patterns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mapping/lines/line_store.h"

namespace slcmap {
namespace {

constexpr double kWall_m = 2, kCourse_m = 0.075;

// A level line on a wall.
MapLine LineAt(double height_m, double probability) {
  MapLine line;
  line.axis = LineAxis::kX;
  line.world = 0;
  line.start_world = {1, kWall_m, height_m};
  line.end_world = {3, kWall_m, height_m};
  line.observations = 9;
  line.SetProbability(probability);
  return line;
}

void Number(std::vector<MapLine>* lines) {
  for (size_t i = 0; i < lines->size(); ++i) (*lines)[i].id = static_cast<int64_t>(i);
}

// Joints of a brick wall, some of them not found, each a little off.
std::vector<MapLine> Joints() {
  std::mt19937 random(5);
  std::normal_distribution<double> off_m(0, 0.003);
  std::vector<MapLine> lines;
  for (int course = 0; course < 30; ++course) {
    if (course % 4 != 1) lines.push_back(LineAt(0.2 + kCourse_m * course + off_m(random), 0.3));
  }
  return lines;
}

TEST(Patterns, JointsOfBricksAreOne) {
  std::vector<MapLine> lines = Joints();
  lines.push_back(LineAt(1.02, 0.2));  // print
  Number(&lines);
  const std::vector<MapPattern> patterns = FindPatterns(&lines);
  ASSERT_EQ(patterns.size(), 1u);
  const MapPattern& pattern = patterns[0];
  EXPECT_NEAR(pattern.spacing_m, kCourse_m, 0.0003);
  EXPECT_LT(pattern.scatter_m, 0.005);
  EXPECT_NEAR(std::abs(pattern.direction_world.x()), 1, 1e-9);
  EXPECT_NEAR(std::abs(pattern.across_world.z()), 1, 1e-9);
  EXPECT_NEAR(pattern.across_m.length_m(), 28 * kCourse_m, 0.02);
  EXPECT_NEAR(pattern.along_m.length_m(), 2, 1e-9);
  EXPECT_EQ(pattern.line_ids.size(), lines.size() - 1);
}

TEST(Patterns, ALineAtAPlaceOfThePatternIsAMarkTheRather) {
  std::vector<MapLine> lines = Joints();
  lines.push_back(LineAt(0.2 + 5 * kCourse_m, 0.6));
  lines.push_back(LineAt(0.2 + 5.5 * kCourse_m, 0.6));
  lines.push_back(LineAt(0.2 + 9 * kCourse_m, 0.99));  // a sill that all else says is an edge
  Number(&lines);
  FindPatterns(&lines);
  const size_t joints = lines.size() - 3;
  EXPECT_EQ(lines[joints].kind, LineKind::kMark);
  EXPECT_EQ(lines[joints + 1].kind, LineKind::kEdge);
  EXPECT_EQ(lines[joints + 2].kind, LineKind::kEdge);
}

TEST(Patterns, LinesAnywhereMakeNone) {
  int found = 0;
  for (unsigned int seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> height_m(0, 2.5);
    std::vector<MapLine> lines;
    for (int i = 0; i < 25; ++i) lines.push_back(LineAt(height_m(random), 0.3));
    Number(&lines);
    found += static_cast<int>(FindPatterns(&lines).size());
  }
  EXPECT_EQ(found, 0);
}

TEST(Patterns, ThoseOfOtherPlanesAndDirectionsDoNotCount) {
  std::vector<MapLine> lines = Joints();
  for (size_t i = 0; i < lines.size(); ++i) {
    const double off_m = 0.2 * static_cast<double>(i);  // as of stairs
    lines[i].start_world.y() += off_m;
    lines[i].end_world.y() += off_m;
  }
  Number(&lines);
  EXPECT_TRUE(FindPatterns(&lines).empty());
}

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
