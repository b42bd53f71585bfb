#include "odometry/residuals/principal_point_residual.h"

#include <gtest/gtest.h>

#include "data/simulator/example.h"
#include "odometry/geometry/pinhole.h"
#include "tests/odometry/residuals/factor_test_utils.h"

namespace slcmap {
namespace {

const Rig kRig = ExampleStereoRig();
constexpr double kFocal_px = 435;
const StereoGeometry kGeometry{kRig.T_imu_camera, kFocal_px / 0.5};

// An ideal pinhole's place on the plane moves with the pixel by one over the focal length.
Eigen::Matrix2d ByPixel() {
  return PlaneByPixel(kRig.cameras[0], Eigen::Quaterniond::Identity(), {0.3, -0.2});
}

TEST(PrincipalPointResidual, APixelOfAPinholeIsOneOverTheFocalLength) {
  EXPECT_LT((ByPixel() - Eigen::Matrix2d::Identity() / kFocal_px).norm(), 1e-9);
}

TEST(PrincipalPointResidual, JacobiansMatchDifferences) {
  const StereoMeasurement both{{0.2, -0.1}, Eigen::Vector2d(0.17, -0.12)};
  const std::vector<double> cameras{0.02, -0.03, 0.01, 0.015, 1.5, -0.7},
      principal_px{1, -2, 0.5, 3};
  ExpectJacobiansMatchDifferences(
      PrincipalPointResidual(std::make_unique<HostPointResidual>(kGeometry, both), kGeometry.weight,
                             {ByPixel(), ByPixel()}),
      {cameras, principal_px, {0.21, -0.13, 0.27}}, 1e-6);
  const std::vector<double> host = PoseBlockOf({ExpRotation({0.1, -0.4, 2.0}), {1, 2, 3}});
  const std::vector<double> target = PoseBlockOf({ExpRotation({0.15, -0.35, 2.1}), {1.2, 1.9, 3}});
  ExpectJacobiansMatchDifferences(
      PrincipalPointResidual(
          std::make_unique<PointResidual>(&kGeometry, StereoMeasurement{both.left, {}}),
          kGeometry.weight, {ByPixel(), ByPixel()}),
      {host, target, cameras, principal_px, {0.21, -0.13, 0.27}}, 1e-6);
}

// What a camera measures whose principal point is off fits once that is known.
TEST(PrincipalPointResidual, IsZeroAtTheTruePrincipalPoint) {
  const Eigen::Vector2d left(0.21, -0.13), off_px(2, -1);
  const StereoMeasurement seen{left + off_px / kFocal_px, {}};
  const PrincipalPointResidual factor(std::make_unique<HostPointResidual>(kGeometry, seen),
                                      kGeometry.weight, {ByPixel(), ByPixel()});
  const double cameras[kCameraCalibrationSize] = {}, principal_px[] = {2, -1, 0, 0};
  const double point[] = {left.x(), left.y(), 0.3};
  const double* blocks[] = {cameras, principal_px, point};
  Eigen::Vector2d residual;
  factor.Evaluate(blocks, residual.data(), nullptr);
  EXPECT_LT(residual.norm(), 1e-6);
}

}  // namespace
}  // namespace slcmap
