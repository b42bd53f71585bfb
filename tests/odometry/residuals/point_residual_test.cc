#include "odometry/factors/point_residual.h"

#include <gtest/gtest.h>

#include "data/simulator/motion.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "tests/odometry/residuals/factor_test_utils.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

struct PointScene {
  StereoGeometry geometry{ExampleStereoRig().T_imu_camera, 600.0};
  RigidTransform host{ExpRotation({0.1, -0.4, 2.0}), {1, 2, 3}};
  RigidTransform target{ExpRotation({0.15, -0.35, 2.1}), {1.2, 1.9, 3.1}};
  Eigen::Vector2d left{0.21, -0.13};
  double inverse_depth = 0.27;
  std::vector<double> cameras = std::vector<double>(kCameraCalibrationSize);

  PointScene() {
    const Rig rig = ExampleStereoRig();
    geometry.lens_shifts =
        std::make_shared<const std::vector<LensShift>>(ComputeLensShifts(rig, rig));
  }

  Eigen::Vector3d World() const {
    return host * (geometry.T_imu_camera[0] *
                   Eigen::Vector3d(Eigen::Vector3d(left.x(), left.y(), 1) / inverse_depth));
  }
  Eigen::Vector2d Seen(const RigidTransform& pose, int camera) const {
    const Eigen::Vector3d p = (pose * geometry.T_imu_camera[camera]).Inverse() * World();
    return p.head<2>() / p.z();
  }
  Blocks MakeBlocks() const {
    return {PoseBlockOf(host), PoseBlockOf(target), cameras, {left.x(), left.y(), inverse_depth}};
  }
};

// Through cameras of which the right one is turned and off its principal point, both longer.
Eigen::Vector4d ByDefinition(const PointScene& scene, const StereoMeasurement& measured) {
  const double scale = 1 + scene.cameras[3], focal_px = ExampleStereoRig().cameras[1].fx_px;
  Eigen::Vector4d residual;
  for (int c = 0; c < 2; ++c) {
    Eigen::Vector3d p = (scene.target * scene.geometry.T_imu_camera[c]).Inverse() * scene.World();
    Eigen::Vector2d at = (c == 0 ? measured.left : *measured.right) / scale;
    if (c == 1) {
      p = ExpRotation(-Eigen::Vector3d::Map(scene.cameras.data())) * p;
      at -= Eigen::Vector2d::Map(scene.cameras.data() + 4) / focal_px;
    }
    residual.segment<2>(2 * c) = scene.geometry.weight * scale * (p.hnormalized() - at);
  }
  return residual;
}

TEST(PointResidual, IsWhatItsDefinitionSaysWithItsJacobians) {
  PointScene scene;
  scene.cameras = {0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  const StereoMeasurement measured{{0.3, -0.1}, Eigen::Vector2d(0.25, -0.08)};
  const PointResidual factor(&scene.geometry, measured);
  const Blocks blocks = scene.MakeBlocks();
  EXPECT_LT((Residual(factor, blocks) - ByDefinition(scene, measured)).norm(), 1e-9);
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
  ExpectJacobiansMatchDifferences(PointResidual(&scene.geometry, {{0.3, -0.1}, {}}), blocks, 1e-6);
  ExpectJacobiansMatchDifferences(
      HostPointResidual(scene.geometry, {{0.2, -0.1}, Eigen::Vector2d(0.17, -0.12)}),
      {scene.cameras, {0.21, -0.13, 0.27}}, 1e-6);
}

TEST(PointResidual, JacobiansWithTheReadoutMatchDifferences) {
  const PointScene scene;
  auto residual = std::make_unique<PointResidual>(
      &scene.geometry, StereoMeasurement{{0.3, -0.1}, Eigen::Vector2d(0.25, -0.08)});
  Blocks blocks = scene.MakeBlocks();
  const std::vector<double> host = blocks[0];
  blocks[0][0] += 0.01;
  residual->SetLinearizationPoint(0, host.data());
  const Eigen::Vector4d without = Linearized(*residual, blocks).residual;
  const Eigen::Vector4d by_readout(100, -200, 50, 300);
  const ByReadoutResidual factor(std::move(residual), by_readout, 0.01);
  Blocks with_readout = blocks;
  with_readout.insert(with_readout.begin(), {0.015});
  EXPECT_LT((Linearized(factor, with_readout).residual - without - 0.005 * by_readout).norm(),
            1e-9);
  with_readout[1] = host;
  ExpectJacobiansMatchDifferences(factor, with_readout, 1e-6);
}

// Of two cameras that look apart: seen by the second one, of a host's second one or first.
TEST(PointResidual, AnyCameraMayBeHostAndTarget) {
  const PointScene scene;
  const StereoMeasurement of_second{{0.3, -0.1}, {}, 1};
  const std::vector<double> off = {0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  for (const int host : {0, 1}) {
    const Eigen::Vector3d p_host =
        Eigen::Vector3d(scene.left.x(), scene.left.y(), 1) / scene.inverse_depth;
    const Eigen::Vector3d p_world = scene.host * (scene.geometry.T_imu_camera[host] * p_host);
    const Eigen::Vector3d p_target =
        (scene.target * scene.geometry.T_imu_camera[1]).Inverse() * p_world;
    const PointResidual factor(&scene.geometry, of_second, host);
    const Eigen::VectorXd r = Residual(factor, scene.MakeBlocks());
    EXPECT_LT((r - 600 * (p_target.hnormalized() - of_second.left)).norm(), 1e-9) << host;
    Blocks corrected = scene.MakeBlocks();
    corrected[2] = off;
    ExpectJacobiansMatchDifferences(factor, corrected, 1e-6);
  }
  ExpectJacobiansMatchDifferences(HostPointResidual(scene.geometry, of_second),
                                  {off, {0.21, -0.13, 0.27}}, 1e-6);
}

TEST(HostPointResidual, IsZeroAtTheTruePoint) {
  const PointScene scene;
  const HostPointResidual factor(scene.geometry, {scene.left, scene.Seen(scene.host, 1)});
  const auto blocks = scene.MakeBlocks();
  EXPECT_LT(Residual(factor, {blocks[2], blocks[3]}).norm(), 1e-9);
}

TEST(PointResidual, APointBehindTheTargetNeitherFailsNorPulls) {
  const PointScene scene;
  const PointResidual factor(&scene.geometry, {{0, 0}, {}});
  RigidTransform flipped = scene.host;
  flipped.rotation = flipped.rotation * ExpRotation({3.14159, 0, 0});
  const Linearized at(
      factor, {PoseBlockOf(scene.host), PoseBlockOf(flipped), scene.cameras, {0, 0, 5}}, false);
  EXPECT_TRUE(at.residual.allFinite());
  for (const RowMajor& jacobian : at.jacobians) EXPECT_EQ(jacobian.norm(), 0);
}

TEST(Factor, FirstEstimateJacobiansBelongToTheLinearizationPoint) {
  const PointScene scene;
  const StereoMeasurement measured{{0.3, -0.1}, {}};
  PointResidual factor(&scene.geometry, measured);
  auto blocks = scene.MakeBlocks();
  auto moved = blocks;
  const double delta[] = {0.05, -0.02, 0.01, 0.03, 0.02, -0.04};
  PoseManifold().Plus(blocks[1].data(), delta, moved[1].data());
  const RowMajor at_blocks = Linearized(factor, blocks).jacobians[1];
  const auto [r_moved, at_moved] = Linearized(factor, moved);
  factor.SetLinearizationPoint(1, blocks[1].data());
  const auto [r_fixed, fixed] = Linearized(factor, moved);
  EXPECT_EQ(r_fixed, r_moved);
  EXPECT_EQ(fixed[1], at_blocks);
  EXPECT_GT((fixed[1] - at_moved[1]).norm(), 1e-3);
}

Preintegration SomePreintegration() {
  Preintegration imu(ImuNoise(), {0.01, -0.02, 0.03}, {0.1, 0.05, -0.1});
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.005 * i;
    ImuSample s;
    s.stamp_ns = ToNanoseconds(t);
    s.angular_velocity_rad_s << std::sin(3 * t), 0.8 * std::cos(2 * t), 0.4 + t;
    s.specific_force_m_s2 << 1 + t, std::cos(5 * t), 9.5;
    imu.Append(s);
  }
  return imu;
}

std::vector<double> SomeCalibration() {
  return {0.04,   -0.07, 0.05,  0.03, -0.02, 0.05,  0.02,   0.02,  -0.01,  0.015, 0.004,
          -0.003, 0.006, -0.02, 0.01, 0.03,  0.002, -0.004, 0.005, -0.001, 0.003, -0.006};
}

TEST(ImuResidual, JacobiansMatchDifferences) {
  const Preintegration imu = SomePreintegration();
  const ImuResidual factor(&imu, {7'000'000, {0.3, 0.8, -0.4}}, {-4'000'000, {-0.2, 0.5, 0.9}});
  const std::vector<std::vector<double>> blocks = {
      PoseBlockOf({ExpRotation({0.3, -0.2, 1.0}), {1, 2, 3}}),
      {0.5, -1, 0.2, 0.012, -0.018, 0.031, 0.11, 0.04, -0.12},
      PoseBlockOf({ExpRotation({0.35, -0.1, 1.1}), {1.1, 1.8, 3.05}}),
      {0.6, -0.9, 0.1, 0.013, -0.019, 0.032, 0.12, 0.03, -0.13},
      SomeCalibration()};
  ExpectJacobiansMatchDifferences(factor, blocks, 2e-5);
}

// A body that turns and moves steadily, whose IMU has its own place and clock.
TEST(ImuResidual, TheImuAtTheCutIsWhereTheCalibrationPutsIt) {
  const std::vector<double> some = SomeCalibration();
  const double* calibration = some.data();
  const double speed_bias[] = {0.5, -1, 0.2, 0.012, -0.018, 0.031, 0, 0, 0};
  const ImuCut cut{7'000'000, {0.3, 0.8, -0.4}};
  const RigidTransform body{ExpRotation({0.3, -0.2, 1.0}), {1, 2, 3}};
  const RigidTransform imu = ImuAtCut(body, speed_bias, calibration, cut);
  const RigidTransform back = BodyAtExposure(imu, speed_bias, calibration, cut);
  EXPECT_LT((back.translation - body.translation).norm(), 1e-12);
  EXPECT_LT(LogRotation(back.rotation.conjugate() * body.rotation).norm(), 1e-12);
  // The exposure is 13 ms after the cut.
  const RigidTransform at_exposure = body * BodyFromImu(calibration);
  EXPECT_LT(
      (at_exposure.translation - 0.013 * Eigen::Vector3d(0.5, -1, 0.2) - imu.translation).norm(),
      1e-12);
  EXPECT_LT((LogRotation(imu.rotation.conjugate() * at_exposure.rotation) -
             0.013 * Eigen::Vector3d(0.288, 0.818, -0.431))
                .norm(),
            1e-12);
}

TEST(ZeroVelocityResidual, JacobianMatchesDifferences) {
  ExpectJacobiansMatchDifferences(ZeroVelocityResidual(0.02), {{1, 2, 3, 4, 5, 6, 7, 8, 9}}, 1e-6);
}

}  // namespace
}  // namespace slcmap
