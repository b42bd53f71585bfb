#include "odometry/factors/point_residual.h"

#include <gtest/gtest.h>

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
  std::vector<std::vector<double>> Blocks() const {
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

TEST(PointResidual, IsWhatItsDefinitionSays) {
  PointScene scene;
  scene.cameras = {0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  const StereoMeasurement measured{{0.3, -0.1}, Eigen::Vector2d(0.25, -0.08)};
  const PointResidual factor(&scene.geometry, measured);
  const auto blocks = scene.Blocks();
  const double* pointers[] = {blocks[0].data(), blocks[1].data(), blocks[2].data(),
                              blocks[3].data()};
  Eigen::Vector4d r;
  factor.Evaluate(pointers, r.data(), nullptr);
  EXPECT_LT((r - ByDefinition(scene, measured)).norm(), 1e-9);
}

TEST(PointResidual, JacobiansMatchDifferences) {
  PointScene scene;
  scene.cameras = {0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  ExpectJacobiansMatchDifferences(
      PointResidual(&scene.geometry, {{0.3, -0.1}, Eigen::Vector2d(0.25, -0.08)}), scene.Blocks(),
      1e-6);
  ExpectJacobiansMatchDifferences(PointResidual(&scene.geometry, {{0.3, -0.1}, {}}), scene.Blocks(),
                                  1e-6);
  ExpectJacobiansMatchDifferences(
      HostPointResidual(scene.geometry, {{0.2, -0.1}, Eigen::Vector2d(0.17, -0.12)}),
      {scene.cameras, {0.21, -0.13, 0.27}}, 1e-6);
}

TEST(PointResidual, JacobiansWithTheReadoutMatchDifferences) {
  const PointScene scene;
  auto residual = std::make_unique<PointResidual>(
      &scene.geometry, StereoMeasurement{{0.3, -0.1}, Eigen::Vector2d(0.25, -0.08)});
  std::vector<std::vector<double>> blocks = scene.Blocks();
  const std::vector<double> host = blocks[0];
  blocks[0][0] += 0.01;
  residual->SetLinearizationPoint(0, host.data());
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  Eigen::Vector4d without, with;
  residual->Linearize(pointers.data(), without.data(), nullptr);
  const Eigen::Vector4d by_readout(100, -200, 50, 300);
  const ByReadoutResidual factor(std::move(residual), by_readout, 0.01);
  const double readout_s = 0.015;
  pointers.insert(pointers.begin(), &readout_s);
  factor.Linearize(pointers.data(), with.data(), nullptr);
  EXPECT_LT((with - without - 0.005 * by_readout).norm(), 1e-9);
  blocks[0] = host;
  blocks.insert(blocks.begin(), {readout_s});
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

// Of two cameras that look apart: seen by the second one, of a host's second one or first.
TEST(PointResidual, AnyCameraMayBeHostAndTarget) {
  PointScene scene;
  const StereoMeasurement of_second{{0.3, -0.1}, {}, 1};
  for (const int host : {0, 1}) {
    const Eigen::Vector3d p_host =
        Eigen::Vector3d(scene.left.x(), scene.left.y(), 1) / scene.inverse_depth;
    const Eigen::Vector3d p_world = scene.host * (scene.geometry.T_imu_camera[host] * p_host);
    const Eigen::Vector3d p_target =
        (scene.target * scene.geometry.T_imu_camera[1]).Inverse() * p_world;
    const PointResidual factor(&scene.geometry, of_second, host);
    const auto blocks = scene.Blocks();
    const double* pointers[] = {blocks[0].data(), blocks[1].data(), blocks[2].data(),
                                blocks[3].data()};
    Eigen::Vector2d r;
    factor.Evaluate(pointers, r.data(), nullptr);
    EXPECT_LT((r - 600 * (p_target.hnormalized() - of_second.left)).norm(), 1e-9) << host;
  }
  scene.cameras = {0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  for (const int host : {0, 1}) {
    ExpectJacobiansMatchDifferences(PointResidual(&scene.geometry, of_second, host), scene.Blocks(),
                                    1e-6);
  }
  ExpectJacobiansMatchDifferences(HostPointResidual(scene.geometry, of_second),
                                  {scene.cameras, {0.21, -0.13, 0.27}}, 1e-6);
}

TEST(HostPointResidual, IsZeroAtTheTruePoint) {
  const PointScene scene;
  const HostPointResidual factor(scene.geometry, {scene.left, scene.Seen(scene.host, 1)});
  const auto blocks = scene.Blocks();
  const double* pointers[] = {blocks[2].data(), blocks[3].data()};
  Eigen::Vector4d r;
  factor.Evaluate(pointers, r.data(), nullptr);
  EXPECT_LT(r.norm(), 1e-9);
}

TEST(PointResidual, APointBehindTheTargetNeitherFailsNorPulls) {
  PointScene scene;
  scene.target.translation = scene.World() + scene.target.rotation * Eigen::Vector3d(0, 0, 1) * 3;
  scene.inverse_depth = 5;
  const PointResidual factor(&scene.geometry, {{0, 0}, {}});
  RigidTransform flipped = scene.host;
  flipped.rotation = flipped.rotation * ExpRotation({3.14159, 0, 0});
  const std::vector<std::vector<double>> blocks = {
      PoseBlockOf(scene.host), PoseBlockOf(flipped), scene.cameras, {0, 0, 5}};
  const double* pointers[] = {blocks[0].data(), blocks[1].data(), blocks[2].data(),
                              blocks[3].data()};
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> h, t;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> d;
  Eigen::Matrix<double, 2, 4, Eigen::RowMajor> c;
  Eigen::Vector2d r;
  double* jacobians[] = {h.data(), t.data(), c.data(), d.data()};
  ASSERT_TRUE(factor.Evaluate(pointers, r.data(), jacobians));
  EXPECT_TRUE(r.allFinite());
  EXPECT_EQ(h.norm() + t.norm() + c.norm() + d.norm(), 0);
}

TEST(Factor, FirstEstimateJacobiansBelongToTheLinearizationPoint) {
  const PointScene scene;
  const StereoMeasurement measured{{0.3, -0.1}, {}};
  PointResidual factor(&scene.geometry, measured);
  auto blocks = scene.Blocks();
  auto moved = blocks;
  const double delta[] = {0.05, -0.02, 0.01, 0.03, 0.02, -0.04};
  PoseManifold().Plus(blocks[1].data(), delta, moved[1].data());
  const auto linearize = [](const Factor& f, const std::vector<std::vector<double>>& x,
                            Eigen::Matrix<double, 2, 6, Eigen::RowMajor>* t) {
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> h;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> d;
    Eigen::Vector2d r;
    double* jacobians[] = {h.data(), t->data(), nullptr, d.data()};
    const double* pointers[] = {x[0].data(), x[1].data(), x[2].data(), x[3].data()};
    f.Linearize(pointers, r.data(), jacobians);
    return r;
  };
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> at_blocks, at_moved, fixed;
  linearize(factor, blocks, &at_blocks);
  const Eigen::Vector2d r_moved = linearize(factor, moved, &at_moved);
  factor.SetLinearizationPoint(1, blocks[1].data());
  const Eigen::Vector2d r_fixed = linearize(factor, moved, &fixed);
  EXPECT_EQ(r_fixed, r_moved);
  EXPECT_EQ(fixed, at_blocks);
  EXPECT_GT((fixed - at_moved).norm(), 1e-3);
}

}  // namespace
}  // namespace slcmap
