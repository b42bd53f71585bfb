// Segments of known lines as a level or tilted camera sees them, for tests.
#include "odometry/structure/manhattan_detector.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "data/core/math.h"
#include "data/core/types.h"

namespace slcmap {
namespace testing {

constexpr double kFocal_px = 400;

// A camera that looks along the heading, pitched down: its z forward, x right, y down.
Eigen::Matrix3d CameraLooking(double heading_rad, double pitch_down_rad) {
  const Eigen::Vector3d forward(std::cos(heading_rad) * std::cos(pitch_down_rad),
                                std::sin(heading_rad) * std::cos(pitch_down_rad),
                                -std::sin(pitch_down_rad));
  const Eigen::Vector3d right(std::sin(heading_rad), -std::cos(heading_rad), 0);
  Eigen::Matrix3d R_world_camera;
  R_world_camera << right, forward.cross(right), forward;
  return R_world_camera;
}

struct WorldLine {
  Eigen::Vector3d start, end;  // metres, from the camera's centre
};

// On the plane z = 1, with noise across and along; nothing where an end is not in view.
std::optional<LineSegment> Project(const WorldLine& line, const Eigen::Matrix3d& R_world_camera,
                                   double sigma_px = 0, std::mt19937* random = nullptr) {
  const Eigen::Vector3d s = R_world_camera.transpose() * line.start;
  const Eigen::Vector3d e = R_world_camera.transpose() * line.end;
  if (s.z() < 0.2 || e.z() < 0.2) return std::nullopt;
  LineSegment out{s.head<2>() / s.z(), e.head<2>() / e.z()};
  if (out.start.cwiseAbs().maxCoeff() > 1 || out.end.cwiseAbs().maxCoeff() > 1) {
    return std::nullopt;
  }
  if (random != nullptr) {
    std::normal_distribution<double> noise(0, sigma_px / kFocal_px);
    for (Eigen::Vector2d* end : {&out.start, &out.end})
      *end += Eigen::Vector2d(noise(*random), noise(*random));
  }
  return out;
}

// Lines of a direction scattered in the space before and around the camera.
std::vector<WorldLine> ScatteredLines(const Eigen::Vector3d& direction, int count,
                                      std::mt19937* random) {
  std::uniform_real_distribution<double> place(-6, 6), height(-1.5, 1.5), length(0.5, 2);
  std::vector<WorldLine> lines;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d middle(place(*random), place(*random), height(*random));
    const Eigen::Vector3d half = 0.5 * length(*random) * direction.normalized();
    lines.push_back({middle - half, middle + half});
  }
  return lines;
}

std::vector<LineSegment> ProjectAll(const std::vector<WorldLine>& lines,
                                    const Eigen::Matrix3d& R_world_camera, double sigma_px,
                                    std::mt19937* random) {
  std::vector<LineSegment> segments;
  for (const WorldLine& line : lines) {
    const auto segment = Project(line, R_world_camera, sigma_px, random);
    if (segment) segments.push_back(*segment);
  }
  return segments;
}

}  // namespace testing

namespace {

using testing::WorldLine;

Eigen::Vector3d Heading(double rad) { return {std::cos(rad), std::sin(rad), 0}; }

void Append(std::vector<WorldLine>* lines, std::vector<WorldLine> more) {
  lines->insert(lines->end(), more.begin(), more.end());
}

// The headings found by a camera that turns once about itself, with 0.5 px of noise.
class ManhattanDetectorTest : public ::testing::Test {
 protected:
  void AddBuilding(double heading_rad, int lines_an_axis) {
    Append(&lines_, testing::ScatteredLines(Heading(heading_rad), lines_an_axis, &random_));
    Append(&lines_,
           testing::ScatteredLines(Heading(heading_rad + 90 * kDegree), lines_an_axis, &random_));
    Append(&lines_, testing::ScatteredLines(Eigen::Vector3d::UnitZ(), lines_an_axis, &random_));
  }

  void AddClutter(int count) {
    std::normal_distribution<double> normal;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d d(normal(random_), normal(random_), normal(random_));
      Append(&lines_, testing::ScatteredLines(d, 1, &random_));
    }
  }

  std::vector<double> Turn(int images, const Eigen::Matrix3d& R_world_tilted) {
    return Look(images, 0, 0.2, R_world_tilted);
  }

  // The same of one that turns by a step an image.
  std::vector<double> Look(int images, double heading_rad, double step_rad,
                           const Eigen::Matrix3d& R_world_tilted = Eigen::Matrix3d::Identity()) {
    std::vector<double> found;
    for (int i = 0; i < images; ++i) {
      const Eigen::Matrix3d R =
          testing::CameraLooking(heading_rad + step_rad * i, 0.1 * std::sin(0.7 * i));
      const auto segments = testing::ProjectAll(lines_, R, 0.5, &random_);
      for (const auto& heading : detector_.AddImage(segments, R_world_tilted * R)) {
        found.push_back(heading.heading_rad);
      }
    }
    return found;
  }
  std::vector<double> Turn(int images) { return Turn(images, Eigen::Matrix3d::Identity()); }

  // Lines along one heading, on all sides of the camera or to the left of it only.
  void AddOneAxis(double heading_rad, int count, bool all_around) {
    std::vector<WorldLine> lines = testing::ScatteredLines(Heading(heading_rad), count, &random_);
    const Eigen::Vector3d left = Heading(heading_rad + 90 * kDegree);
    if (!all_around) {
      std::erase_if(lines, [&](const WorldLine& line) { return left.dot(line.start) < 2; });
    }
    Append(&lines_, lines);
  }

  std::mt19937 random_{3};
  std::vector<WorldLine> lines_;
  ManhattanDetector detector_{ManhattanOptions(), testing::kFocal_px};
};

TEST_F(ManhattanDetectorTest, FindsTheHeading) {
  struct Case {
    const char* what;
    double heading_deg, found_deg, within_deg, tilt_deg;
    int clutter;
  };
  for (const Case& c : {Case{"among clutter", 20, 20, 0.2, 0, 30},
                        Case{"that repeats after a quarter turn", 100, 10, 0.1, 0, 0},
                        Case{"of a tilted world", -30, -30, 0.2, 0.3, 40}}) {
    SCOPED_TRACE(c.what);
    random_.seed(3);
    lines_.clear();
    detector_.Reset();
    AddBuilding(c.heading_deg * kDegree, 60);
    AddClutter(c.clutter);
    const Eigen::AngleAxisd tilt(c.tilt_deg * kDegree, Eigen::Vector3d(0.6, 0.8, 0));
    const auto found = Turn(60, tilt.toRotationMatrix());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0], c.found_deg * kDegree, c.within_deg * kDegree);
  }
}

TEST_F(ManhattanDetectorTest, FindsNoneInNothingAndInClutter) {
  EXPECT_TRUE(Turn(20).empty());
  EXPECT_FALSE(detector_.Best().has_value());
  AddClutter(300);
  Append(&lines_, testing::ScatteredLines(Eigen::Vector3d::UnitZ(), 60, &random_));
  EXPECT_TRUE(Turn(200).empty());
}

// Walls at odd angles: each has a direction of its own, and none at right angles to it.
TEST_F(ManhattanDetectorTest, FindsNoneBetweenOddWalls) {
  for (const double degrees : {0, 17, 35, 52, 71, 101, 118, 137, 154}) {
    Append(&lines_, testing::ScatteredLines(Heading(degrees * kDegree), 25, &random_));
  }
  AddClutter(40);
  EXPECT_TRUE(Turn(200).empty());
}

// A colonnade, or a corridor whose edges across are hardly seen.
TEST_F(ManhattanDetectorTest, OneAxisIsEnoughWhereItLasts) {
  for (const bool all_around : {true, false}) {
    detector_.Reset();
    lines_.clear();
    AddOneAxis(25 * kDegree, all_around ? 90 : 270, all_around);
    AddClutter(40);
    const auto look = [&](int images) {
      return all_around ? Turn(images) : Look(images, 75 * kDegree, 0.02);
    };
    EXPECT_TRUE(look(20).empty());
    const auto found = look(25);
    ASSERT_EQ(found.size(), 1u) << (all_around ? "around" : "to one side");
    EXPECT_NEAR(found[0], 25 * kDegree, 0.2 * kDegree);
  }
}

// Furniture that stands askew has one too.
TEST_F(ManhattanDetectorTest, OneAxisIsNotEnoughForAFurtherHeading) {
  AddOneAxis(25 * kDegree, 90, true);
  AddClutter(40);
  detector_.SetKnownHeadings({0});
  EXPECT_TRUE(Turn(80).empty());
}

// A pitched roof has more rafters than there are edges along the building.
TEST_F(ManhattanDetectorTest, WhatFollowsAKnownSlopeDoesNotVote) {
  AddBuilding(20 * kDegree, 60);
  const Eigen::Vector3d to_ridge = Heading(110 * kDegree), up = Eigen::Vector3d::UnitZ();
  std::vector<Eigen::Vector3d> slopes;
  for (const double side : {-1, 1}) {
    slopes.push_back((side * to_ridge + 0.8 * up).normalized());
    Append(&lines_, testing::ScatteredLines(slopes.back(), 120, &random_));
  }
  EXPECT_TRUE(Turn(60).empty());
  detector_.SetKnownSlopes(slopes);
  const auto found = Turn(30);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0], 20 * kDegree, 0.2 * kDegree);
}

TEST_F(ManhattanDetectorTest, FindsASecondHeadingLaterEvenThreeDegreesFromTheFirst) {
  for (const auto& [second_deg, clutter, within_deg] :
       {std::tuple(35.0, 20, 0.15), {8.0, 0, 0.3}}) {
    random_.seed(3);
    lines_.clear();
    detector_ = ManhattanDetector(ManhattanOptions(), testing::kFocal_px);
    AddBuilding(5 * kDegree, 60);
    AddClutter(clutter);
    EXPECT_EQ(Turn(60).size(), 1u);
    lines_.clear();
    AddBuilding(second_deg * kDegree, 60);
    AddClutter(clutter);
    const auto found = Turn(60);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0], second_deg * kDegree, within_deg * kDegree);
    EXPECT_EQ(detector_.known_headings_rad().size(), 2u);
  }
}

TEST_F(ManhattanDetectorTest, DoesNotFindAKnownHeadingAgain) {
  AddBuilding(5 * kDegree, 60);
  detector_.SetKnownHeadings({5.1 * kDegree});
  EXPECT_TRUE(Turn(60).empty());
  detector_.Reset();
  EXPECT_EQ(Turn(60).size(), 1u);
}

using testing::CameraLooking;

class LineClassifierTest : public ::testing::Test {
 protected:
  std::optional<LineClass> ClassOf(const Eigen::Vector3d& middle, const Eigen::Vector3d& direction,
                                   double length_m = 1,
                                   const std::vector<std::optional<double>>& headings_rad = {0.3}) {
    const Eigen::Vector3d half = 0.5 * length_m * direction.normalized();
    const auto segment = testing::Project({middle - half, middle + half}, R_world_camera_);
    EXPECT_TRUE(segment.has_value());
    return classifier_.Classify(*segment, R_world_camera_, headings_rad);
  }

  static Eigen::Vector3d Heading(double rad) { return {std::cos(rad), std::sin(rad), 0}; }

  const LineClassifier classifier_{testing::kFocal_px};
  const Eigen::Matrix3d R_world_camera_ = CameraLooking(0.6, 0.1);
  const Eigen::Vector3d ahead_ = 5 * Heading(0.6) + Eigen::Vector3d(0, 0, 0.7);
};

TEST_F(LineClassifierTest, TellsTheAxesOfOneWorldAndTheVerticalWithoutAny) {
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3)), (LineClass{LineAxis::kX, 0}));
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3 + 90 * kDegree)), (LineClass{LineAxis::kY, 0}));
  EXPECT_EQ(ClassOf(ahead_, Eigen::Vector3d::UnitZ()), (LineClass{LineAxis::kVertical, -1}));
  EXPECT_EQ(ClassOf(ahead_, Eigen::Vector3d::UnitZ(), 1, {}), (LineClass{LineAxis::kVertical, -1}));
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3), 1, {}), std::nullopt);
  // One that was withdrawn is none.
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3), 1, {std::nullopt, 0.3}), (LineClass{LineAxis::kX, 1}));
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3), 1, {std::nullopt}), std::nullopt);
}

TEST_F(LineClassifierTest, TellsWorldsThreeDegreesApartByLongLinesOverhead) {
  const std::vector<std::optional<double>> two = {0.3, 0.3 + 3 * kDegree};
  const Eigen::Vector3d overhead = ahead_ + Eigen::Vector3d(0, 0, 3);
  for (const int world : {0, 1}) {
    const Eigen::Vector3d along_y = Heading(*two[world] + 90 * kDegree);
    EXPECT_EQ(ClassOf(overhead, along_y, 3, two), (LineClass{LineAxis::kY, world}));
    EXPECT_EQ(ClassOf(ahead_, along_y, 3, two), std::nullopt) << "nearly level with the camera";
  }
}

TEST_F(LineClassifierTest, LeavesOutOtherDirections) {
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3 + 90 * kDegree) + Eigen::Vector3d(0, 0, 0.2)),
            std::nullopt);
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3 + 110 * kDegree)), std::nullopt);
}

// At the height of the camera every horizontal line looks alike.
TEST_F(LineClassifierTest, LeavesOutWhatCouldBeTwoAxes) {
  EXPECT_EQ(ClassOf(5 * Heading(0.6), Heading(0.3)), std::nullopt);
  EXPECT_EQ(ClassOf(ahead_, Heading(0.3), 0.03), std::nullopt);  // too short to tell
}

// The standard deviation is that of angles measured with noise.
TEST(InterpretationPlaneTest, SigmaIsTheSpreadOfNoisyAngles) {
  std::mt19937 random(1);
  const testing::WorldLine line{{4, -1, 1}, {5, 1.5, 1}};
  const Eigen::Matrix3d R = testing::CameraLooking(0.1, 0.05);
  const Eigen::Vector3d d = (line.end - line.start).normalized();
  std::normal_distribution<double> turn(0, 0.002);
  double sum = 0, predicted = 0;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {
    const auto segment = testing::Project(line, R, 0.8, &random);
    const InterpretationPlane plane = PlaneOfSegment(*segment, 0.8 / testing::kFocal_px).Rotated(R);
    const Eigen::Vector3d known =
        (d + Eigen::Vector3d(turn(random), turn(random), turn(random))).normalized();
    const VanishingAngle v = AngleToVanishingPoint(plane, known, 0.002);
    sum += v.angle_rad * v.angle_rad / n;
    predicted += v.sigma_rad * v.sigma_rad / n;
  }
  EXPECT_NEAR(std::sqrt(sum / predicted), 1, 0.15);
}

TEST(InterpretationPlaneTest, AngleMeansNothingAtTheVanishingPoint) {
  const InterpretationPlane plane = PlaneOfSegment({{-0.01, 0}, {0.01, 0.02}}, 0.001);
  EXPECT_GT(AngleToVanishingPoint(plane, Eigen::Vector3d(0, 0.01, 1).normalized(), 0.005).sigma_rad,
            1);
}

}  // namespace
}  // namespace slcmap
