#include <ceres/autodiff_cost_function.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/simulator/example.h"
#include "odometry/residuals/along_axis_residual.h"
#include "odometry/residuals/along_slope_residual.h"
#include "odometry/residuals/general_line_residual.h"
#include "odometry/residuals/point_on_line_residual.h"
#include "odometry/residuals/structural_line_residual.h"
#include "tests/odometry/residuals/factor_test_utils.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Blocks = std::vector<std::vector<double>>;
template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

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
  StereoLineMeasurement ObservationOf(const Vector3d& a, const Vector3d& b) const {
    return {{Seen(a, 0), Seen(b, 0)}, LineSegment{Seen(a, 1), Seen(b, 1)}};
  }
};

Blocks StructuralBlocks(const LineScene& scene, const StructuralLine& line) {
  const StructuralLineBlock block = StructuralLineThrough(line, kHeading, scene.Visible());
  if (!line.HasHeading()) return {PoseBlockOf(scene.pose), {block[0], block[1]}};
  return {PoseBlockOf(scene.pose), {kHeading}, {block[0], block[1]}};
}

Eigen::VectorXd Residual(const Factor& factor, const Blocks& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  Eigen::VectorXd r(factor.rows());
  EXPECT_TRUE(factor.Evaluate(pointers.data(), r.data(), nullptr));
  return r;
}

// Compares a factor with a cost function that automatic differentiation derives, on the tangents.
void ExpectSameAsTwin(const Factor& factor, const ceres::CostFunction& twin, const Blocks& blocks) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<const double*> pointers;
  std::vector<RowMajor> ours, theirs;
  std::vector<double*> to_ours, to_theirs;
  for (const auto& block : blocks) {
    pointers.push_back(block.data());
    ours.emplace_back(factor.rows(), block.size());
    theirs.emplace_back(factor.rows(), block.size());
  }
  for (size_t k = 0; k < blocks.size(); ++k) {
    to_ours.push_back(ours[k].data());
    to_theirs.push_back(theirs[k].data());
  }
  Eigen::VectorXd r(factor.rows()), r_twin(factor.rows());
  factor.Evaluate(pointers.data(), r.data(), to_ours.data());
  twin.Evaluate(pointers.data(), r_twin.data(), to_theirs.data());
  EXPECT_LT((r - r_twin).norm(), 1e-9 * r.norm());
  EXPECT_GT(r.norm(), 1e-3);
  for (size_t k = 0; k < blocks.size(); ++k) {
    const int size = static_cast<int>(blocks[k].size());
    const BlockKind& kind = factor.kind(static_cast<int>(k));
    RowMajor plus = RowMajor::Identity(size, kind.tangent_size);
    if (kind.manifold) kind.manifold()->PlusJacobian(pointers[k], plus.data());
    EXPECT_LT((ours[k] * plus - theirs[k] * plus).norm(), 1e-9 * (1 + (ours[k] * plus).norm()))
        << "block " << k << "\nours\n"
        << ours[k] * plus << "\ntwin\n"
        << theirs[k] * plus;
  }
}

// Method, section 2, to the letter: a point of the line and its direction, brought to the camera.
template <typename T>
void ObservationByDefinition(const LineScene& scene, const T* pose, const Vec3<T>& p_world,
                             const Vec3<T>& d_world, T* residual) {
  const Eigen::Map<const Eigen::Quaternion<T>> q(pose + 3);
  const Eigen::Map<const Vec3<T>> p(pose);
  for (int c = 0; c < 2; ++c) {
    const RigidTransform& T_ic = scene.geometry.T_imu_camera[c];
    const Eigen::Quaternion<T> r_ci = T_ic.rotation.conjugate().cast<T>();
    const Vec3<T> in_imu = q.conjugate() * Vec3<T>(p_world - p);
    const Vec3<T> p_c = r_ci * Vec3<T>(in_imu - T_ic.translation.cast<T>());
    const Vec3<T> d_c = r_ci * Vec3<T>(q.conjugate() * d_world);
    const Vec3<T> n = p_c.cross(d_c);
    const LineSegment& segment = c == 0 ? scene.off.left : *scene.off.right;
    const T m = sqrt(n.x() * n.x() + n.y() * n.y());
    for (int end = 0; end < 2; ++end) {
      const Vector2d& s = end == 0 ? segment.start : segment.end;
      residual[2 * c + end] = scene.geometry.weight * (s.x() * n.x() + s.y() * n.y() + n.z()) / m;
    }
  }
}

template <typename T>
struct ManhattanByDefinition {
  explicit ManhattanByDefinition(const T& heading) {
    axes << cos(heading), -sin(heading), T(0), sin(heading), cos(heading), T(0), T(0), T(0), T(1);
  }
  Vec3<T> Crossing(const StructuralLine& line, const T* block) const {
    const int k = static_cast<int>(line.axis);
    const int across[3][2] = {{1, 2}, {0, 2}, {0, 1}};
    return line.anchor_world.cast<T>() + axes.col(across[k][0]) * cos(block[0]) / block[1] +
           axes.col(across[k][1]) * sin(block[0]) / block[1];
  }
  Eigen::Matrix<T, 3, 3> axes;
};

struct StructuralByDefinition {
  const LineScene* scene;
  StructuralLine line;
  template <typename T>
  bool operator()(const T* pose, const T* heading, const T* block, T* residual) const {
    const ManhattanByDefinition<T> m(*heading);
    const Vec3<T> d = m.axes.col(static_cast<int>(line.axis));
    ObservationByDefinition<T>(*scene, pose, m.Crossing(line, block), d, residual);
    return true;
  }
  template <typename T>
  bool operator()(const T* pose, const T* block, T* residual) const {
    const T heading(0);
    return (*this)(pose, &heading, block, residual);
  }
};

struct GeneralByDefinition {
  const LineScene* scene;
  template <typename T>
  bool operator()(const T* pose, const T* block, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(block);
    const Vec3<T> moment = q * Vec3<T>(cos(block[4]), T(0), T(0));
    const Vec3<T> direction = q * Vec3<T>(T(0), sin(block[4]), T(0));
    const Vec3<T> nearest = direction.cross(moment) / direction.squaredNorm();
    ObservationByDefinition<T>(*scene, pose, scene->anchor.cast<T>() + nearest, direction,
                               residual);
    return true;
  }
};

struct PointOnFreeLineByDefinition {
  const LineScene* scene;
  double sigma_m;
  template <typename T>
  bool operator()(const T* pose, const T* block, const T* point, T* r) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(pose + 3), u(block);
    const RigidTransform& T_ic = scene->geometry.T_imu_camera[0];
    const Vec3<T> z(point[0], point[1], T(1));
    const Vec3<T> in_imu =
        T_ic.rotation.cast<T>() * Vec3<T>(z / point[2]) + T_ic.translation.cast<T>();
    const Vec3<T> p_world = q * in_imu + Eigen::Map<const Vec3<T>>(pose);
    const Vec3<T> nearest =
        scene->anchor.cast<T>() - u * Vec3<T>(T(0), T(0), cos(block[4]) / sin(block[4]));
    const Vec3<T> off = u.conjugate() * Vec3<T>(p_world - nearest);
    r[0] = off[0] / sigma_m;
    r[1] = off[2] / sigma_m;
    return true;
  }
};

struct AlongAxisByDefinition {
  LineAxis axis;
  double sigma_rad;
  template <typename T>
  bool operator()(const T* heading, const T* block, T* r) const {
    const Vec3<T> direction =
        Eigen::Map<const Eigen::Quaternion<T>>(block) * Vec3<T>(T(0), T(1), T(0));
    const ManhattanByDefinition<T> m(*heading);
    const Vec3<T> in_manhattan = m.axes.transpose() * direction;
    int row = 0;
    for (int k = 0; k < 3; ++k) {
      if (k != static_cast<int>(axis)) r[row++] = in_manhattan[k] / sigma_rad;
    }
    return true;
  }
  template <typename T>
  bool operator()(const T* block, T* r) const {
    const T heading(0);
    return (*this)(&heading, block, r);
  }
};

struct AlongSlopeByDefinition {
  double sigma_rad;
  template <typename T>
  bool operator()(const T* slope, const T* block, T* r) const {
    const Vec3<T> d = Eigen::Map<const Eigen::Quaternion<T>>(block) * Vec3<T>(T(0), T(1), T(0));
    const T c = ceres::cos(slope[0]), s = ceres::sin(slope[0]);
    const T along = c * d[0] + s * d[1];  // level
    r[0] = (c * d[1] - s * d[0]) / sigma_rad;
    r[1] = (ceres::cos(slope[1]) * d[2] - ceres::sin(slope[1]) * along) / sigma_rad;
    return true;
  }
};

struct PointOnLineByDefinition {
  const LineScene* scene;
  StructuralLine line;
  double sigma_m;
  template <typename T>
  bool operator()(const T* pose, const T* heading, const T* block, const T* point, T* r) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(pose + 3);
    const RigidTransform& T_ic = scene->geometry.T_imu_camera[0];
    const Vec3<T> z(point[0], point[1], T(1));
    const Vec3<T> in_imu =
        T_ic.rotation.cast<T>() * Vec3<T>(z / point[2]) + T_ic.translation.cast<T>();
    const Vec3<T> p_world = q * in_imu + Eigen::Map<const Vec3<T>>(pose);
    const ManhattanByDefinition<T> m(*heading);
    const Vec3<T> off = m.axes.transpose() * Vec3<T>(m.Crossing(line, block) - p_world);
    int row = 0;
    for (int k = 0; k < 3; ++k) {
      if (k != static_cast<int>(line.axis)) r[row++] = off[k] / sigma_m;
    }
    return true;
  }
  template <typename T>
  bool operator()(const T* pose, const T* block, const T* point, T* r) const {
    const T heading(0);
    return (*this)(pose, &heading, block, point, r);
  }
};

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
  const LineScene scene;
  const std::vector<double> cameras{0.02, -0.03, 0.01, 0.015};
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

Blocks FreeLineBlocks(const LineScene& scene, const Vector3d& direction) {
  const GeneralLineBlock line = GeneralLineThrough(scene.anchor, scene.Visible(), direction);
  return {PoseBlockOf(scene.pose), {line.begin(), line.end()}};
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
    blocks.insert(std::prev(blocks.end()), {3e-3, 1e-3});
    const Eigen::VectorXd own = Residual(AlongAxisResidual(axis, 1e-3, true), blocks);
    EXPECT_LT((own - Vector2d(-2, -3)).norm(), 1e-4) << "beside what it shares";
  }
}

TEST(AlongAxisResidual, WhatIsSharedHasJacobiansAsDifferencesHaveThem) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    Blocks blocks{{2e-3, -1e-3}, FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1]};
    if (axis != LineAxis::kVertical) blocks.insert(blocks.begin(), {kHeading});
    ExpectJacobiansMatchDifferences(AlongAxisResidual(axis, 0.01, true), blocks, 1e-6);
  }
  ExpectJacobiansMatchDifferences(SharedDeviationResidual(0.01), {{2e-3, -1e-3}}, 1e-6);
}

TEST(AlongAxisResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  for (const LineAxis axis : kAxes) {
    const AlongAxisResidual factor(axis, 0.01);
    auto* by_definition = new AlongAxisByDefinition{axis, 0.01};
    const std::vector<double> line = FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1];
    if (axis == LineAxis::kVertical) {
      const ceres::AutoDiffCostFunction<AlongAxisByDefinition, 2, 5> twin(by_definition);
      ExpectSameAsTwin(factor, twin, {line});
    } else {
      const ceres::AutoDiffCostFunction<AlongAxisByDefinition, 2, 1, 5> twin(by_definition);
      ExpectSameAsTwin(factor, twin, {{kHeading}, line});
    }
  }
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
}

TEST(AlongSlopeResidual, JacobiansMatchAutomaticDifferentiation) {
  const LineScene scene;
  const ceres::AutoDiffCostFunction<AlongSlopeByDefinition, 2, 2, 5> twin(
      new AlongSlopeByDefinition{0.01});
  ExpectSameAsTwin(AlongSlopeResidual(0.01), twin,
                   {kSlope, FreeLineBlocks(scene, {0.3, -0.8, 0.4})[1]});
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
