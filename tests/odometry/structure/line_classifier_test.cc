#include <gtest/gtest.h>

#include <random>

#include "data/core/math.h"
#include "odometry/structure/manhattan_detector.h"
#include "tests/odometry/structure/made_segments.h"

namespace slcmap {
namespace {

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
