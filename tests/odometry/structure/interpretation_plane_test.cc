#include <gtest/gtest.h>

#include "data/core/math.h"
#include "odometry/structure/manhattan_detector.h"
#include "tests/odometry/structure/made_segments.h"

namespace slcmap {
namespace {

TEST(InterpretationPlaneTest, HoldsTheSegmentAndIsOrthonormal) {
  const LineSegment segment{{-0.3, 0.1}, {0.4, 0.25}};
  const InterpretationPlane plane = PlaneOfSegment(segment, 0.001);
  EXPECT_NEAR(plane.normal.dot(Eigen::Vector3d(-0.3, 0.1, 1)), 0, 1e-12);
  EXPECT_NEAR(plane.normal.dot(Eigen::Vector3d(0.4, 0.25, 1)), 0, 1e-12);
  Eigen::Matrix3d axes;
  axes << plane.middle, plane.along, plane.normal;
  EXPECT_TRUE((axes.transpose() * axes).isIdentity(1e-12));
}

TEST(InterpretationPlaneTest, AngleIsZeroForTheLinesOwnDirectionInAnyFrame) {
  const Eigen::Vector3d p(1, 2, 8), d = Eigen::Vector3d(0.5, -0.2, 0.9).normalized();
  const Eigen::Vector3d q = p + 2 * d;
  const InterpretationPlane plane =
      PlaneOfSegment({p.head<2>() / p.z(), q.head<2>() / q.z()}, 0.001);
  const Eigen::Matrix3d R = testing::CameraLooking(0.7, 0.2);
  EXPECT_NEAR(AngleToVanishingPoint(plane, d, 0).angle_rad, 0, 1e-9);
  EXPECT_NEAR(AngleToVanishingPoint(plane.Rotated(R), R * d, 0).angle_rad, 0, 1e-9);
  EXPECT_NEAR(AngleToVanishingPoint(plane.Rotated(R), -(R * d), 0).angle_rad, 0, 1e-9);
}

TEST(InterpretationPlaneTest, AngleAtTheCentreIsThatInTheImage) {
  const InterpretationPlane plane = PlaneOfSegment({{-0.1, 0}, {0.1, 0}}, 0.001);
  const Eigen::Vector3d d(std::cos(20 * kDegree), std::sin(20 * kDegree), 0);
  EXPECT_NEAR(AngleToVanishingPoint(plane, d, 0).angle_rad, 20 * kDegree, 1e-12);
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
