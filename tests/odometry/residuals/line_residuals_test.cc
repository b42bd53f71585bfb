// A line before a camera, for the tests of residuals of lines.
#include <gtest/gtest.h>

#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "tests/odometry/residuals/factor_test_utils.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHeading = 0.37;
constexpr LineAxis kAxes[] = {LineAxis::kX, LineAxis::kY, LineAxis::kVertical};

struct LineScene {
  StereoGeometry geometry{ExampleStereoRig().T_imu_camera, 450.0};
  RigidTransform pose{ExpRotation({0.1, -0.4, 2.0}), {1, 2, 3}};
  Vector3d anchor{0.9, 1.7, 3.2};
  StereoLineMeasurement off{{{0.3, -0.1}, {-0.2, 0.25}}, LineSegment{{0.2, -0.12}, {-0.3, 0.2}}};

  // A point that the left camera sees.
  Vector3d Visible() const { return pose * (geometry.T_imu_camera[0] * Vector3d(0.6, -0.3, 3.5)); }
  Vector2d Seen(const Vector3d& p_world, int camera) const {
    const Vector3d p = (pose * geometry.T_imu_camera[camera]).Inverse() * p_world;
    return p.head<2>() / p.z();
  }
};

Blocks StructuralBlocks(const LineScene& scene, const StructuralLine& line) {
  const StructuralLineBlock block = StructuralLineThrough(line, kHeading, scene.Visible());
  if (!line.HasHeading()) return {PoseBlockOf(scene.pose), {block[0], block[1]}};
  return {PoseBlockOf(scene.pose), {kHeading}, {block[0], block[1]}};
}

Blocks FreeLineBlocks(const LineScene& scene, const Vector3d& direction) {
  const GeneralLineBlock line = GeneralLineThrough(scene.anchor, scene.Visible(), direction);
  return {PoseBlockOf(scene.pose), {line.begin(), line.end()}};
}

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

// A residual of each end in each image: how far it is from the image of the line through two
// places.
void ExpectDistancesFromLine(const LineScene& scene, const Vector3d& p, const Vector3d& q,
                             const Eigen::VectorXd& residual) {
  for (int camera = 0; camera < 2; ++camera) {
    const Vector2d from = scene.Seen(p, camera), way = scene.Seen(q, camera) - from;
    const LineSegment& seen = camera == 0 ? scene.off.left : *scene.off.right;
    for (int end = 0; end < 2; ++end) {
      const Vector2d off = (end == 0 ? seen.start : seen.end) - from;
      const double distance = (way.x() * off.y() - way.y() * off.x()) / way.norm();
      EXPECT_NEAR(std::abs(residual[2 * camera + end]), scene.geometry.weight * std::abs(distance),
                  1e-6);
    }
  }
}

TEST(LineResiduals, AreTheDistancesOfTheEndsFromTheLineWithTheirJacobians) {
  const LineScene scene;
  const Vector3d p = scene.Visible();
  for (const LineAxis axis : kAxes) {
    for (const Vector3d& anchor : {scene.anchor, Vector3d(0, 0, 0)}) {
      const StructuralLine line{axis, anchor};
      const StructuralLineResidual factor(&scene.geometry, line, scene.off);
      const StructuralLineBlock block = StructuralLineThrough(line, kHeading, p);
      Blocks blocks = {PoseBlockOf(scene.pose), {kHeading}, {block[0], block[1]}};
      if (!line.HasHeading()) blocks.erase(blocks.begin() + 1);
      ExpectDistancesFromLine(scene, p, p + AxisDirection(axis, kHeading),
                              Residual(factor, blocks));
      ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
    }
  }
  const Vector3d direction(1, 2, -0.4);
  const GeneralLineResidual factor(&scene.geometry, scene.anchor, scene.off);
  const Blocks blocks = FreeLineBlocks(scene, direction);
  ExpectDistancesFromLine(scene, p, p + direction, Residual(factor, blocks));
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

TEST(StructuralLineResidual, JacobiansMatchDifferencesWithOneCameraAndAWeight) {
  LineScene scene;
  scene.off.right.reset();
  scene.off.weight = 0.5;
  const StructuralLine line{LineAxis::kY, scene.anchor};
  ExpectJacobiansMatchDifferences(StructuralLineResidual(&scene.geometry, line, scene.off),
                                  StructuralBlocks(scene, line), 1e-6);
}

// Of two cameras that look apart: what the second one saw, with its calibration.
TEST(LineResiduals, AreThoseOfTheCameraThatSawTheLine) {
  const LineScene scene;
  const Vector3d direction(1, 2, -0.4);
  StereoLineMeasurement of_second{*scene.off.right, {}};
  of_second.camera = 1;
  const GeneralLineResidual both(&scene.geometry, scene.anchor, scene.off);
  const GeneralLineResidual second(&scene.geometry, scene.anchor, of_second);
  Blocks blocks = FreeLineBlocks(scene, direction);
  EXPECT_EQ(Residual(second, blocks), Residual(both, blocks).tail<2>());
  blocks.insert(blocks.begin() + 1, {0.02, -0.03, 0.01, 0.015, 1.5, -0.7});
  ExpectJacobiansMatchDifferences(
      GeneralLineResidual(&scene.geometry, scene.anchor, of_second, true), blocks, 1e-6);
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
      std::make_shared<const std::vector<LensShift>>(ComputeLensShifts(rig, rig));
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
  const Blocks blocks = {PoseBlockOf(scene.pose), {line.begin(), line.end()}};
  const Linearized at(factor, blocks, false);
  EXPECT_TRUE(at.residual.allFinite() && at.jacobians[0].allFinite() &&
              at.jacobians[1].allFinite());
}

constexpr double kOff_m = 0.05, kOnLine_m = 0.1;

// A point of the left camera, by its place on the plane and its inverse depth.
std::vector<double> PointBlock(const LineScene& scene, const Vector3d& p_world) {
  const Vector3d p = (scene.pose * scene.geometry.T_imu_camera[0]).Inverse() * p_world;
  return {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
}

TEST(PointOnLineResidual, IsTheDistanceFromTheLineInStandardDeviations) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const StructuralLine line{axis, scene.anchor};
    const PointOnLineResidual factor(&scene.geometry, line, kOnLine_m);
    const Vector3d on_line = scene.Visible() + 0.3 * AxisDirection(axis, kHeading);
    Blocks blocks = StructuralBlocks(scene, line);
    blocks.push_back(PointBlock(scene, on_line));
    EXPECT_LT(Residual(factor, blocks).norm(), 1e-9);
    blocks.back() = PointBlock(scene, on_line + kOff_m * AxesAcross(axis, kHeading).col(1));
    EXPECT_NEAR(Residual(factor, blocks).norm(), kOff_m / kOnLine_m, 1e-9);
    ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
  }
}

TEST(PointOnLineResidual, WhatIsAtInfinityNeitherFailsNorPulls) {
  const LineScene scene;
  const StructuralLine line{LineAxis::kX, scene.anchor};
  Blocks point = StructuralBlocks(scene, line), far_line = FreeLineBlocks(scene, {0.3, -0.8, 0.4});
  point.push_back({0.2, -0.1, 0});
  ExpectJacobiansMatchDifferences(PointOnLineResidual(&scene.geometry, line, 0.1), point, 1e-9);
  far_line[1][4] = 0;
  far_line.push_back({0.2, -0.1, 0.3});
  ExpectJacobiansMatchDifferences(PointOnFreeLineResidual(&scene.geometry, scene.anchor, 0.1),
                                  far_line, 1e-9);
}

TEST(PointOnFreeLineResidual, IsTheDistanceFromTheLineInStandardDeviations) {
  const LineScene scene;
  const Vector3d direction = Vector3d(0.3, -0.8, 0.4).normalized();
  const Vector3d on_line = scene.Visible() + 0.3 * direction;
  const PointOnFreeLineResidual factor(&scene.geometry, scene.anchor, kOnLine_m);
  Blocks blocks = FreeLineBlocks(scene, direction);
  blocks.push_back(PointBlock(scene, on_line));
  EXPECT_LT(Residual(factor, blocks).norm(), 1e-9);
  blocks.back() = PointBlock(scene, on_line + kOff_m * direction.unitOrthogonal());
  EXPECT_NEAR(Residual(factor, blocks).norm(), kOff_m / kOnLine_m, 1e-9);
  ExpectJacobiansMatchDifferences(factor, blocks, 1e-6);
}

TEST(AlongAxisResidual, IsTheAngleOffTheAxisInStandardDeviations) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const Matrix32d across = AxesAcross(axis, kHeading);
    const Vector3d direction =
        AxisDirection(axis, kHeading) + 1e-3 * across.col(0) - 2e-3 * across.col(1);
    Blocks blocks{FreeLineBlocks(scene, direction)[1]};
    if (axis != LineAxis::kVertical) blocks.insert(blocks.begin(), {kHeading});
    const Eigen::VectorXd r = Residual(AlongAxisResidual(axis, 1e-3), blocks);
    EXPECT_LT((r - Vector2d(1, -2)).norm(), 1e-4);
    Blocks far = blocks;
    far.back() = FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1];
    ExpectJacobiansMatchDifferences(AlongAxisResidual(axis, 0.01), far, 1e-6);
    for (Blocks* with_shared : {&blocks, &far}) {
      with_shared->insert(std::prev(with_shared->end()), {3e-3, 1e-3});
    }
    const Eigen::VectorXd own = Residual(AlongAxisResidual(axis, 1e-3, true), blocks);
    EXPECT_LT((own - Vector2d(-2, -3)).norm(), 1e-4) << "beside what it shares";
    ExpectJacobiansMatchDifferences(AlongAxisResidual(axis, 0.01, true), far, 1e-6);
  }
  ExpectJacobiansMatchDifferences(SharedDeviationResidual(0.01), {{2e-3, -1e-3}}, 1e-6);
}

const std::vector<double> kSlope = {0.7, 0.5};

TEST(AlongSlopeResidual, IsTheAngleOffTheSlopeInStandardDeviations) {
  const LineScene scene;
  const Matrix32d across = AxesAcrossSlope(kSlope.data());
  const Vector3d direction =
      SlopeDirection(kSlope.data()) + 1e-3 * across.col(0) - 2e-3 * across.col(1);
  EXPECT_LT(std::abs(across.col(0).z()), 1e-12) << "the first one is level";
  const Eigen::VectorXd r =
      Residual(AlongSlopeResidual(1e-3), {kSlope, FreeLineBlocks(scene, direction)[1]});
  EXPECT_LT((r - Vector2d(1, -2)).norm(), 1e-4);
  ExpectJacobiansMatchDifferences(AlongSlopeResidual(0.01),
                                  {kSlope, FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1]}, 1e-6);
}

}  // namespace
}  // namespace slcmap
