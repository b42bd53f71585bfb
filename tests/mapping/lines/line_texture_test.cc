#include <gtest/gtest.h>

#include "mapping/lines/line_kinds.h"

namespace slcmap {
namespace {

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
