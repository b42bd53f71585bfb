// A line before a camera, and the residuals of lines by their definitions.
#pragma once

#include <ceres/autodiff_cost_function.h>
#include <gtest/gtest.h>

#include <cmath>

#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "tests/odometry/residuals/factor_test_utils.h"
#include "tests/testing/example.h"

namespace slcmap {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Blocks = std::vector<std::vector<double>>;
template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

inline constexpr double kHeading = 0.37;
inline constexpr LineAxis kAxes[] = {LineAxis::kX, LineAxis::kY, LineAxis::kVertical};

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

inline Blocks StructuralBlocks(const LineScene& scene, const StructuralLine& line) {
  const StructuralLineBlock block = StructuralLineThrough(line, kHeading, scene.Visible());
  if (!line.HasHeading()) return {PoseBlockOf(scene.pose), {block[0], block[1]}};
  return {PoseBlockOf(scene.pose), {kHeading}, {block[0], block[1]}};
}

inline Eigen::VectorXd Residual(const Factor& factor, const Blocks& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  Eigen::VectorXd r(factor.rows());
  EXPECT_TRUE(factor.Evaluate(pointers.data(), r.data(), nullptr));
  return r;
}

// Compares a factor with a cost function that automatic differentiation derives, on the tangents.
inline void ExpectSameAsTwin(const Factor& factor, const ceres::CostFunction& twin,
                             const Blocks& blocks) {
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

inline Blocks FreeLineBlocks(const LineScene& scene, const Vector3d& direction) {
  const GeneralLineBlock line = GeneralLineThrough(scene.anchor, scene.Visible(), direction);
  return {PoseBlockOf(scene.pose), {line.begin(), line.end()}};
}

}  // namespace slcmap
