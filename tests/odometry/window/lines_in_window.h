// Lines of all kinds, with points that belong to them, as terms of a window of four poses.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <vector>

#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "odometry/window/problem.h"
#include "tests/testing/example.h"

namespace slcmap {

// Lines along the three axes and one of no axis, a point on each structural line, and four poses.
class LinesInWindow : public ::testing::Test {
 protected:
  using Vector3d = Eigen::Vector3d;
  static constexpr int kFrames = 4;
  static constexpr std::array kAxes = {LineAxis::kX, LineAxis::kY, LineAxis::kVertical};

  void SetUp() override {
    for (int i = 0; i < kFrames; ++i) PoseToBlock(Pose(i), poses_[i].data());
    for (int k = 0; k < 3; ++k) {
      structural_[k] = StructuralLineThrough(Line(k), heading_[0], Through(k));
      const Vector3d p = (Pose(0) * geometry_.T_imu_camera[0]).Inverse() * Through(k);
      points_[k] = {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
    }
    general_ = GeneralLineThrough(anchor_, Through(3), direction_);
    AddTerms();
  }

  RigidTransform Pose(int i) const {
    return RigidTransform(ExpRotation({0.1, 0.05, 0.3}), {4, -3, 1}) *
           RigidTransform(ExpRotation({0.02 * i, 0.01 * i, -0.03 * i}),
                          geometry_.R_imu_camera[0] * Vector3d(0.2 * i, 0.15 * i, 0.1 * i));
  }
  Vector3d Through(int k) const {
    return Pose(0) * (geometry_.T_imu_camera[0] * Vector3d(0.5 * k - 0.7, 0.3 - 0.2 * k, 3 + k));
  }
  StructuralLine Line(int k) const { return {kAxes[k], anchor_}; }
  StereoLineMeasurement See(int frame, const Vector3d& a, const Vector3d& b) const {
    std::array<LineSegment, 2> seen;
    for (int c = 0; c < 2; ++c) {
      const RigidTransform T = (Pose(frame) * geometry_.T_imu_camera[c]).Inverse();
      const Vector3d p = T * a, q = T * b;
      seen[c] = {p.head<2>() / p.z(), q.head<2>() / q.z()};
    }
    return {seen[0], seen[1]};
  }
  StereoMeasurement SeePoint(int frame, const Vector3d& p) const {
    const StereoLineMeasurement both = See(frame, p, p);
    return {both.left.start, both.right->start};
  }
  void Add(std::unique_ptr<Factor> factor, std::array<double*, Factor::kMaxBlocks> blocks) {
    terms_.push_back({std::move(factor), nullptr, blocks});
  }
  void AddTerms() {
    for (int i = 0; i < kFrames; ++i) {
      double* pose = poses_[i].data();
      for (int k = 0; k < 3; ++k) {
        const Vector3d end = Through(k) + 0.6 * AxisDirection(kAxes[k], heading_[0]);
        auto line =
            std::make_unique<StructuralLineResidual>(&geometry_, Line(k), See(i, Through(k), end));
        double* block = structural_[k].data();
        if (Line(k).HasHeading()) {
          Add(std::move(line), {pose, heading_.data(), block});
        } else {
          Add(std::move(line), {pose, block});
        }
        if (i == 0) continue;
        Add(std::make_unique<PointResidual>(&geometry_, SeePoint(i, Through(k))),
            {poses_[0].data(), pose, cameras_.data(), points_[k].data()});
      }
      Add(std::make_unique<GeneralLineResidual>(&geometry_, anchor_,
                                                See(i, Through(3), Through(3) + direction_)),
          {pose, general_.data()});
    }
    for (int k = 0; k < 3; ++k) {
      auto on_line = std::make_unique<PointOnLineResidual>(&geometry_, Line(k), 0.1);
      double *host = poses_[0].data(), *line = structural_[k].data(), *point = points_[k].data();
      if (Line(k).HasHeading()) {
        Add(std::move(on_line), {host, heading_.data(), line, point});
      } else {
        Add(std::move(on_line), {host, line, point});
      }
    }
  }
  bool IsPose(const double* block) const {
    return std::any_of(poses_.begin(), poses_.end(),
                       [&](const auto& pose) { return pose.data() == block; });
  }

  // Moves all blocks off where they are, by about a share of a metre or a radian.
  void Move(double by) {
    const auto moved = [&](const BlockKind& kind, double* block, double size) {
      const Eigen::VectorXd delta = size * Eigen::VectorXd::Random(kind.tangent_size);
      const std::vector<double> at(block, block + kind.size);
      BlockPlus(kind, at.data(), delta.data(), block);
    };
    for (auto& pose : poses_) moved(kPoseKind, pose.data(), by);
    moved(kHeadingKind, heading_.data(), by);
    for (auto& line : structural_) moved(kStructuralLineKind, line.data(), by);
    for (auto& point : points_) moved(kPointKind, point.data(), by);
    moved(kGeneralLineKind, general_.data(), by);
  }

  // Takes the terms out that speak of points or of one of the blocks.
  std::vector<Term> TakeTermsOf(const std::vector<double*>& blocks) {
    const auto speaks = [&](const Term& term) {
      for (int k = 0; k < term.factor->blocks(); ++k) {
        if (term.factor->kind(k).is_point ||
            std::find(blocks.begin(), blocks.end(), term.blocks[k]) != blocks.end()) {
          return true;
        }
      }
      return false;
    };
    const auto first = std::stable_partition(terms_.begin(), terms_.end(),
                                             [&](const Term& term) { return !speaks(term); });
    std::vector<Term> taken(std::make_move_iterator(first), std::make_move_iterator(terms_.end()));
    terms_.erase(first, terms_.end());
    return taken;
  }

  // Lets the terms keep the linearisation points of a prior.
  void KeepLinearization(const Prior& prior) {
    for (Term& term : terms_) {
      for (int k = 0; k < term.factor->blocks(); ++k) {
        const auto at = std::find(prior.blocks.begin(), prior.blocks.end(), term.blocks[k]);
        if (at == prior.blocks.end()) continue;
        term.factor->SetLinearizationPoint(
            k, prior.x_lin[static_cast<size_t>(at - prior.blocks.begin())].data());
      }
    }
  }

  // How a block moves when the whole world is moved by a small transform.
  Eigen::VectorXd Moved(const double* block, const BlockKind& kind, const RigidTransform& by,
                        double yaw) const {
    std::vector<double> moved(block, block + kind.size);
    if (kind.size == kPoseSize) PoseToBlock(by * PoseFromBlock(block), moved.data());
    if (block == heading_.data()) moved[0] += yaw;
    for (int k = 0; k < 3; ++k) {
      if (block != structural_[k].data()) continue;
      const Vector3d p = by * CrossingPoint(Line(k), heading_[0], block);
      const StructuralLineBlock at = StructuralLineThrough(Line(k), heading_[0] + yaw, p);
      moved.assign(at.begin(), at.end());
    }
    if (block == general_.data()) {
      const PointAndDirection line = GeneralLineFromBlock(anchor_, block);
      const GeneralLineBlock at =
          GeneralLineThrough(anchor_, by * line.point_world, by.rotation * line.direction_world);
      moved.assign(at.begin(), at.end());
    }
    Eigen::VectorXd d(kind.tangent_size);
    BlockMinus(kind, moved.data(), block, d.data());
    return d;
  }

  StereoGeometry geometry_{ExampleStereoRig().T_imu_camera, 450};
  Vector3d anchor_ = (Pose(0) * geometry_.T_imu_camera[0]).translation;
  Vector3d direction_{0.4, -0.5, 0.3};
  std::array<std::array<double, kPoseSize>, kFrames> poses_;
  std::array<double, kHeadingSize> heading_{0.2};
  std::array<StructuralLineBlock, 3> structural_;
  std::array<std::array<double, kPointSize>, 3> points_;
  GeneralLineBlock general_;
  CameraCalibrationBlock cameras_{0.01, -0.02, 0.01, 0.002};
  std::vector<Term> terms_;
};

}  // namespace slcmap
