#include "mapping/lines/patterns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "data/core/error.h"
#include "mapping/map/part_files.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::MessageOf;

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

// What is read and written again.
std::vector<MapPattern> Reread(const std::vector<MapPattern>& patterns) {
  const testing::TempFolder folder;
  WritePatterns(folder.Path("patterns.json"), patterns);
  return ReadPatterns(folder.Path("patterns.json"));
}

TEST(PatternFile, IsReadAsItWasWritten) {
  std::vector<MapLine> lines = Joints();
  Number(&lines);
  const MapPattern pattern = FindPatterns(&lines).at(0);
  const std::vector<MapPattern> read = Reread(Reread({pattern}));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_NEAR(read[0].spacing_m, pattern.spacing_m, 1e-6);
  EXPECT_EQ(read[0].line_ids, pattern.line_ids);
  EXPECT_NEAR((read[0].origin_world - pattern.origin_world).norm(), 0, 1e-4);
}

TEST(PatternFile, WhatCannotBeIsNamed) {
  MapPattern turned, swapped;
  turned.spacing_m = swapped.spacing_m = 0.1;
  turned.direction_world = {0.5, 0, 0};
  swapped.direction_world = {1, 0, 0};
  swapped.across_m = {1, -1};
  EXPECT_THAT(MessageOf<DataError>([&] { Reread({turned}); }), HasSubstr("pattern 0: direction"));
  EXPECT_THAT(MessageOf<DataError>([&] { Reread({swapped}); }),
              HasSubstr("expected the lesser first"));
}

}  // namespace
}  // namespace slcmap
