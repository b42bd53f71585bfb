// The estimator on images whose rows are not exposed at once: what it takes at its own time, and
// what that is worth.
#include <gtest/gtest.h>

#include <memory>

#include "odometry/window/problem.h"
#include "tests/testing/example.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Two frames of a rolling rig that turns and moves, a point and a line that both see.
class RollingFrames : public ::testing::Test {
 protected:
  RollingFrames() {
    model_.geometry = model_.lines = StereoGeometry(ExampleStereoRig().T_imu_camera, 600);
    for (int i = 0; i < 2; ++i) {
      auto& frame = window_.frames.emplace_back(std::make_unique<FrameState>());
      frame->id = i;
      const RigidTransform pose(ExpRotation({0.02 * i, 0.1 * i, 0.05}),
                                Vector3d(0.3, 0.2, 0.1) * i);
      PoseToBlock(pose, frame->pose.data());
      frame->speed_bias = {0.9, -0.4, 0.3, 0.01, -0.02, 0.03, 0.1, 0.05, -0.1};
      frame->felt.rate_rad_s << 0.5, -0.8, 0.4;
      frame->felt.rate_change_rad_s2 << 2, -3, 1;
      frame->felt.force_m_s2 << 1, -2, 9;
      See(frame.get());
    }
    PointLandmark& point = window_.landmarks[kId];
    point.id = kId;
    point.triangulated = true;
    for (auto& frame : window_.frames) point.frames.push_back(frame.get());
    const Vector3d p = CameraPose(*point.host(), 0, 0).Inverse() * p_world_;
    point.point = {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
    LineLandmark& line = window_.lines[kId];
    line.id = kId;
    line.estimated = true;
    line.anchor_world = Vector3d(0.1, 0.2, 0);
    line.block = GeneralLineThrough(line.anchor_world, p_world_, along_world_.normalized());
    for (auto& frame : window_.frames) line.frames.push_back(frame.get());
  }

  RigidTransform CameraPose(const FrameState& frame, int camera, double after_s) const {
    return frame.T_world_imu() * GetMotion(frame, *model_.calibration).At(after_s) *
           model_.geometry.T_imu_camera[camera];
  }

  TimedPlace SeeAt(const FrameState& frame, int camera, const Vector3d& p_world,
                   double after_s) const {
    constexpr double kReadout_s = 0.03;
    return {(CameraPose(frame, camera, after_s).Inverse() * p_world).hnormalized(), after_s,
            after_s / kReadout_s};
  }

  void See(FrameState* frame) const {
    StereoMeasurement& point = frame->measurements[kId];
    point.right.emplace();
    StereoLineMeasurement& line = frame->lines[kId];
    line.right.emplace();
    for (const int camera : {0, 1}) {
      point.timed.push_back(SeeAt(*frame, camera, p_world_, -0.006 + 0.011 * camera));
      for (const int end : {0, 1}) {
        const Vector3d p_world = p_world_ + (end - 0.4) * along_world_;
        line.timed.push_back(SeeAt(*frame, camera, p_world, -0.009 + 0.012 * camera + 0.005 * end));
      }
    }
  }

  std::vector<FixedTerm> Terms() const {
    std::vector<FixedTerm> terms = FixedPointTerms(window_.landmarks.at(kId), model_);
    for (const auto& frame : window_.frames) {
      terms.push_back(FixedLineTerm(window_.lines.at(kId), *frame, model_));
    }
    return terms;
  }

  // A column a term.
  Eigen::Matrix4Xd Residuals() const {
    const std::vector<FixedTerm> terms = Terms();
    Eigen::Matrix4Xd residuals(4, std::ssize(terms));
    for (size_t i = 0; i < terms.size(); ++i) {
      residuals.col(static_cast<Eigen::Index>(i)) = ComputeResidual(terms[i]);
    }
    return residuals;
  }

  double LargestResidual() const { return Residuals().cwiseAbs().maxCoeff(); }

  static constexpr int64_t kId = 7;
  CostModel model_;
  Vector3d p_world_ = ExampleStereoRig().T_imu_camera[0] * Vector3d(0.5, -0.3, 3);
  Vector3d along_world_{0.2, 0.9, 0.4};
  WindowState window_;
};

TEST_F(RollingFrames, WhatIsExactAtItsOwnTimeIsExactAtTheStamp) {
  for (auto& frame : window_.frames) {  // as if all were exposed at the stamp
    StereoMeasurement& point = frame->measurements.at(kId);
    point.left = point.timed[0].on_plane;
    point.right = point.timed[1].on_plane;
    StereoLineMeasurement& line = frame->lines.at(kId);
    line.left = {line.timed[0].on_plane, line.timed[1].on_plane};
    line.right = LineSegment{line.timed[2].on_plane, line.timed[3].on_plane};
  }
  EXPECT_GT(LargestResidual(), 2);
  BringToStamps(model_, &window_);
  EXPECT_LT(LargestResidual(), 1e-6);
}

// The derivatives of a residual whose place is held are those at its own time, up to how much the
// view changes meanwhile.
TEST_F(RollingFrames, DerivativesAreThoseOfTheOwnTime) {
  BringToStamps(model_, &window_);
  FrameState& frame = *window_.frames[1];
  const TimedPlace timed = frame.measurements.at(kId).timed[0];
  const double weight = model_.geometry.weight;
  const PoseBlock pose = frame.pose;
  const auto at = [&](int dimension, double by, bool own_time) -> Vector2d {
    Eigen::Matrix<double, 6, 1> delta = Eigen::Matrix<double, 6, 1>::Zero();
    delta[dimension] = by;
    BlockPlus(kPoseKind, pose.data(), delta.data(), frame.pose.data());
    const Vector2d own =
        weight * (SeeAt(frame, 0, p_world_, timed.after_s).on_plane - timed.on_plane);
    const Vector2d held =
        ComputeResidual(FixedPointTerm(window_.landmarks.at(kId), frame, model_)).head<2>();
    frame.pose = pose;
    return own_time ? own : held;
  };
  constexpr double kStep = 1e-6;
  for (int dimension = 0; dimension < 6; ++dimension) {
    const Vector2d own = (at(dimension, kStep, true) - at(dimension, -kStep, true)) / (2 * kStep);
    const Vector2d held =
        (at(dimension, kStep, false) - at(dimension, -kStep, false)) / (2 * kStep);
    EXPECT_LT((own - held).norm(), 0.03 * weight) << dimension;
  }
}

// Host and target, points and lines: what a term has of the readout is how its residual changes
// when everything is brought to its stamp by another one.
TEST_F(RollingFrames, TheReadoutMovesAllThatIsTimed) {
  model_.readout = std::make_unique<double>(0.001);
  const auto residuals_at = [&](double readout_s) {
    *model_.readout = readout_s;
    BringToStamps(model_, &window_);
    return Residuals();
  };
  constexpr double kStep_s = 1e-5;
  const Eigen::Matrix4Xd difference =
      (residuals_at(0.001 + kStep_s) - residuals_at(0.001 - kStep_s)) / (2 * kStep_s);
  residuals_at(0.001);
  Eigen::Index column = 0;
  for (const FixedTerm& term : Terms()) {
    Eigen::Vector4d residual, by_readout;
    std::array<double*, Factor::kMaxBlocks> jacobians{by_readout.data()};
    ASSERT_EQ(term.factor->rows(), 4);
    term.factor->Linearize(term.blocks.data(), residual.data(), jacobians.data());
    const Eigen::Vector4d expected = difference.col(column++);
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 10) << column;
    EXPECT_LT((by_readout - expected).norm(), 0.01 * expected.norm()) << column;
  }
  EXPECT_EQ(column, 4);
}

SimulatedRunOptions PerfectRows(double right_offset_s, double readout_s) {
  SimulatedRunOptions options;
  options.duration_s = 9;
  options.imu_rate_hz = 1000;
  options.right_offset_s = right_offset_s;
  options.readout_s = readout_s;
  return options;
}

TEST(EstimatorOfRows, RollingShuttersAndLateRightImagesCostLittle) {
  for (const auto& [right_offset_s, readout_s] : {std::pair{-0.008, 0.0}, {0.008, 0.02}}) {
    SimulatedRunOptions options = PerfectRows(right_offset_s, readout_s);
    const double known_m = LargestPositionError(RunOnSimulatedTracks(options));
    options.takes_rows_at_once = true;
    const double ignored_m = LargestPositionError(RunOnSimulatedTracks(options));
    EXPECT_LT(known_m, 0.004) << right_offset_s << " " << readout_s;
    EXPECT_LT(5 * known_m, ignored_m) << right_offset_s << " " << readout_s;
  }
}

// From none and from too much.
TEST(EstimatorOfRows, FindTheReadout) {
  constexpr double kTrue_s = 0.02;
  for (const double given_s : {0.0, 0.03}) {
    SimulatedRunOptions options = PerfectRows(0, kTrue_s);
    options.fault.readout_s = given_s - kTrue_s;
    options.odometry.calibration.readout = true;
    double found_s = 0;
    const SimulatedRun run = RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
      found_s = given_s + *estimator->window().model().readout;
    });
    EXPECT_NEAR(found_s, kTrue_s, 2e-4) << given_s;
    EXPECT_LT(LargestPositionError(run), 0.006) << given_s;
  }
}

TEST(EstimatorOfRows, StartsInMotion) {
  SimulatedRunOptions options = PerfectRows(0.008, 0.02);
  options.stand_still_s = 0;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  ASSERT_GT(run.states.size(), 120u);
  EXPECT_LT(LargestPositionError(run), 0.01);
}

}  // namespace
}  // namespace slcmap
