#include "tests/odometry/residuals/line_residuals_by_definition.h"

namespace slcmap {
namespace {

TEST(StructuralLine, PassesThroughThePointItIsMadeFrom) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    const StructuralLineBlock block = StructuralLineThrough(line, kHeading, scene.Visible());
    const Vector3d crossing = CrossingPoint(line, kHeading, block.data());
    const Vector3d direction = AxisDirection(axis, kHeading);
    EXPECT_LT((scene.Visible() - crossing).cross(direction).norm(), 1e-12);
    EXPECT_LT(std::abs((crossing - scene.anchor).dot(direction)), 1e-12);
  }
}

TEST(GeneralLine, IsTheLineItIsMadeFrom) {
  const Vector3d anchor(1, 2, 3), p(4, -1, 2), d(0.3, 0.5, -2);
  const GeneralLineBlock block = GeneralLineThrough(anchor, p, d);
  const PointAndDirection line = GeneralLineFromBlock(anchor, block.data());
  EXPECT_LT((line.direction_world - d.normalized()).norm(), 1e-12);
  EXPECT_LT((line.point_world - p).cross(d).norm(), 1e-12);
  EXPECT_LT(std::abs((line.point_world - anchor).dot(d)), 1e-12);
}

TEST(StructuralLineResidual, IsZeroWhereTheGeometryIsExact) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    const Vector3d a = scene.Visible(), b = a + 0.4 * AxisDirection(axis, kHeading);
    const StructuralLineResidual factor(&scene.geometry, line, scene.ObservationOf(a, b));
    EXPECT_LT(Residual(factor, StructuralBlocks(scene, line)).norm(), 1e-9);
  }
}

TEST(StructuralLineResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    for (const Vector3d& anchor : {scene.anchor, Vector3d(0, 0, 0)}) {
      const StructuralLine line{axis, anchor};
      const StructuralLineResidual factor(&scene.geometry, line, scene.off);
      auto* by_definition = new StructuralByDefinition{&scene, line};
      const Blocks blocks = StructuralBlocks(scene, line);
      if (line.HasHeading()) {
        const ceres::AutoDiffCostFunction<StructuralByDefinition, 4, 7, 1, 2> twin(by_definition);
        ExpectSameAsTwin(factor, twin, blocks);
      } else {
        const ceres::AutoDiffCostFunction<StructuralByDefinition, 4, 7, 2> twin(by_definition);
        ExpectSameAsTwin(factor, twin, blocks);
      }
    }
  }
}

TEST(StructuralLineResidual, JacobiansMatchDifferencesWithOneCameraAndAWeight) {
  LineScene scene;
  scene.off.right.reset();
  scene.off.weight = 0.5;
  const StructuralLine line{LineAxis::kY, scene.anchor};
  ExpectJacobiansMatchDifferences(StructuralLineResidual(&scene.geometry, line, scene.off),
                                  StructuralBlocks(scene, line), 1e-6);
}

TEST(StructuralLineResidual, IsSmoothThroughInfinity) {
  const LineScene scene;
  const StructuralLine line{LineAxis::kX, scene.anchor};
  const StructuralLineResidual factor(&scene.geometry, line, scene.off);
  Blocks blocks = StructuralBlocks(scene, line);
  const auto at = [&](double rho) {
    blocks[2][1] = rho;
    return Residual(factor, blocks);
  };
  EXPECT_LT((at(1e-9) - at(-1e-9)).norm(), 1e-5);
  blocks[2][1] = 0;
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

TEST(LineResiduals, BindTheCamerasWhereAsked) {
  LineScene scene;
  const Rig rig = ExampleStereoRig();
  scene.geometry.lens_shifts =
      std::make_shared<const std::array<LensShift, 2>>(ComputeLensShifts(rig, rig));
  const std::vector<double> cameras{0.02, -0.03, 0.01, 0.015, 1.5, -0.7};
  const StereoGeometry corrected = scene.geometry.CorrectedBy(cameras.data());
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    Blocks blocks = StructuralBlocks(scene, line);
    const Eigen::VectorXd expected =
        Residual(StructuralLineResidual(&corrected, line, scene.off), blocks);
    blocks.insert(blocks.begin() + 1, cameras);
    const StructuralLineResidual factor(&scene.geometry, line, scene.off, true);
    EXPECT_LT((Residual(factor, blocks) - expected).norm(), 1e-9);
    ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
  }
  const Vector3d d(0.3, -0.5, 0.2);
  const GeneralLineBlock block = GeneralLineThrough(scene.anchor, scene.Visible(), d);
  const GeneralLineResidual factor(&scene.geometry, scene.anchor, scene.off, true);
  ExpectJacobiansMatchDifferences(
      factor, {PoseBlockOf(scene.pose), cameras, {block.begin(), block.end()}}, 1e-6);
}

TEST(LineResiduals, ALineThroughTheCameraNeitherFailsNorPulls) {
  const LineScene scene;
  const Vector3d centre = (scene.pose * scene.geometry.T_imu_camera[0]).translation;
  const GeneralLineResidual factor(&scene.geometry, scene.anchor, {scene.off.left, {}});
  const GeneralLineBlock line = GeneralLineThrough(scene.anchor, centre, {0.2, 0.3, 0.4});
  const std::vector<double> pose = PoseBlockOf(scene.pose);
  const double* pointers[] = {pose.data(), line.data()};
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> by_pose;
  Eigen::Matrix<double, 2, 5, Eigen::RowMajor> by_line;
  Vector2d r;
  double* jacobians[] = {by_pose.data(), by_line.data()};
  ASSERT_TRUE(factor.Evaluate(pointers, r.data(), jacobians));
  EXPECT_TRUE(r.allFinite() && by_pose.allFinite() && by_line.allFinite());
}

TEST(GeneralLineResidual, IsZeroWhereTheGeometryIsExact) {
  const LineScene scene;
  const Vector3d a = scene.Visible(), d(0.3, -0.2, 0.25);
  const GeneralLineResidual factor(&scene.geometry, scene.anchor, scene.ObservationOf(a, a + d));
  const GeneralLineBlock block = GeneralLineThrough(scene.anchor, a, d);
  EXPECT_LT(Residual(factor, {PoseBlockOf(scene.pose), {block.begin(), block.end()}}).norm(), 1e-9);
}

TEST(GeneralLineResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  const GeneralLineResidual factor(&scene.geometry, scene.anchor, scene.off);
  const GeneralLineBlock block = GeneralLineThrough(scene.anchor, scene.Visible(), {1, 2, -0.4});
  const Blocks blocks = {PoseBlockOf(scene.pose), {block.begin(), block.end()}};
  const ceres::AutoDiffCostFunction<GeneralByDefinition, 4, 7, 5> twin(
      new GeneralByDefinition{&scene});
  ExpectSameAsTwin(factor, twin, blocks);
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

TEST(PointOnLineResidual, IsZeroForAPointOfTheLine) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    const Vector3d p = (scene.pose * scene.geometry.T_imu_camera[0]).Inverse() *
                       (scene.Visible() + 0.3 * AxisDirection(axis, kHeading));
    Blocks blocks = StructuralBlocks(scene, line);
    blocks.push_back({p.x() / p.z(), p.y() / p.z(), 1 / p.z()});
    EXPECT_LT(Residual(PointOnLineResidual(&scene.geometry, line, 0.1), blocks).norm(), 1e-9);
  }
}

TEST(PointOnLineResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    const PointOnLineResidual factor(&scene.geometry, line, 0.1);
    auto* by_definition = new PointOnLineByDefinition{&scene, line, 0.1};
    Blocks blocks = StructuralBlocks(scene, line);
    blocks.push_back({0.2, -0.1, 0.3});
    if (line.HasHeading()) {
      const ceres::AutoDiffCostFunction<PointOnLineByDefinition, 2, 7, 1, 2, 3> twin(by_definition);
      ExpectSameAsTwin(factor, twin, blocks);
    } else {
      const ceres::AutoDiffCostFunction<PointOnLineByDefinition, 2, 7, 2, 3> twin(by_definition);
      ExpectSameAsTwin(factor, twin, blocks);
    }
  }
}

TEST(PointOnLineResidual, APointAtInfinityNeitherFailsNorPulls) {
  const LineScene scene;
  const StructuralLine line{LineAxis::kX, scene.anchor};
  Blocks blocks = StructuralBlocks(scene, line);
  blocks.push_back({0.2, -0.1, 0});
  ExpectJacobiansMatchDifferences(PointOnLineResidual(&scene.geometry, line, 0.1), blocks, 1e-9);
}

TEST(PointOnFreeLineResidual, IsZeroForAPointOfTheLine) {
  const LineScene scene;
  const Vector3d direction = Vector3d(0.3, -0.8, 0.4).normalized();
  Blocks blocks = FreeLineBlocks(scene, direction);
  const Vector3d p =
      (scene.pose * scene.geometry.T_imu_camera[0]).Inverse() * (scene.Visible() + 0.3 * direction);
  blocks.push_back({p.x() / p.z(), p.y() / p.z(), 1 / p.z()});
  EXPECT_LT(Residual(PointOnFreeLineResidual(&scene.geometry, scene.anchor, 0.1), blocks).norm(),
            1e-9);
}

TEST(PointOnFreeLineResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  Blocks blocks = FreeLineBlocks(scene, {0.3, -0.8, 0.4});
  blocks.push_back({0.2, -0.1, 0.3});
  using Twin = ceres::AutoDiffCostFunction<PointOnFreeLineByDefinition, 2, 7, 5, 3>;
  ExpectSameAsTwin(PointOnFreeLineResidual(&scene.geometry, scene.anchor, 0.1),
                   Twin(new PointOnFreeLineByDefinition{&scene, 0.1}), blocks);
}

TEST(PointOnFreeLineResidual, ALineAtInfinityNeitherFailsNorPulls) {
  const LineScene scene;
  Blocks blocks = FreeLineBlocks(scene, {0.3, -0.8, 0.4});
  blocks[1][4] = 0;
  blocks.push_back({0.2, -0.1, 0.3});
  ExpectJacobiansMatchDifferences(PointOnFreeLineResidual(&scene.geometry, scene.anchor, 0.1),
                                  blocks, 1e-9);
}

// Nobody can observe where the whole scene is, nor how it is turned about the vertical.
TEST(LineResiduals, AreInvariantToHeadingAndPosition) {
  const LineScene scene;
  const double yaw = 2.1;
  const RigidTransform moved(ExpRotation({0, 0, yaw}), {10, -7, 3});
  const RigidTransform identity;
  const Vector3d p = scene.Visible(), direction(1, 2, -0.4);
  const auto residuals = [&](const RigidTransform& by, double turn) {
    std::vector<Eigen::VectorXd> all;
    const std::vector<double> pose = PoseBlockOf(by * scene.pose);
    const double heading = kHeading + turn;
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      const StructuralLine line{axis, by * scene.anchor};
      const StructuralLineBlock block = StructuralLineThrough(line, heading, by * p);
      Blocks blocks = {pose, {heading}, {block[0], block[1]}};
      all.push_back(Residual(StructuralLineResidual(&scene.geometry, line, scene.off), blocks));
      blocks.push_back({0.2, -0.1, 0.3});
      all.push_back(Residual(PointOnLineResidual(&scene.geometry, line, 0.1), blocks));
    }
    const StructuralLine vertical{LineAxis::kVertical, by * scene.anchor};
    const StructuralLineBlock block = StructuralLineThrough(vertical, 0, by * p);
    all.push_back(Residual(StructuralLineResidual(&scene.geometry, vertical, scene.off),
                           {pose, {block[0], block[1]}}));
    const GeneralLineBlock general =
        GeneralLineThrough(by * scene.anchor, by * p, by.rotation * direction);
    all.push_back(Residual(GeneralLineResidual(&scene.geometry, by * scene.anchor, scene.off),
                           {pose, {general.begin(), general.end()}}));
    return all;
  };
  const auto before = residuals(identity, 0), after = residuals(moved, yaw);
  for (size_t k = 0; k < before.size(); ++k) {
    EXPECT_LT((after[k] - before[k]).norm(), 1e-9 * before[k].norm()) << "term " << k;
  }
}

}  // namespace
}  // namespace slcmap
