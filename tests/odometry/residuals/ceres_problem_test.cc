// The residuals in a problem of Ceres' own, without the sliding window.
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <vector>

#include "data/simulator/motion.h"
#include "odometry/factors/imu_factor.h"
#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kFrames = 5;
constexpr double kFrom_s = 2, kStep_s = 0.3;
constexpr std::array kAxes = {LineAxis::kX, LineAxis::kY, LineAxis::kVertical};

// A rig that flies past points, a line along each axis of a building, and one of no axis. A point
// lies on each of the lines along axes.
class CeresProblemTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < kFrames; ++i) {
      PoseToBlock(Pose(i), poses_[i].data());
      Vector3d::Map(speed_biases_[i].data()) = motion_.VelocityAt(kFrom_s + i * kStep_s);
    }
    for (int k = 0; k < 3; ++k) {
      lines_[k] = StructuralLineThrough(Line(k), heading_[0], InWorld(k));
    }
    general_ = GeneralLineThrough(anchor_, InWorld(3), direction_);
    for (size_t k = 0; k < points_.size(); ++k) {
      const Vector3d p = InCamera(static_cast<int>(k));
      points_[k] = {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
    }
    Integrate();
  }

  RigidTransform Pose(int i) const { return motion_.PoseAt(kFrom_s + i * kStep_s); }
  StructuralLine Line(int k) const { return {kAxes[k], anchor_}; }
  Vector3d InCamera(int k) const {
    return {0.4 * (k % 4) - 0.6, 0.3 * (k % 3) - 0.25, 3 + 0.5 * (k % 5)};
  }
  Vector3d InWorld(int k) const { return Pose(0) * (geometry_.T_imu_camera[0] * InCamera(k)); }

  void Integrate() {
    ImuSimulatorOptions options;
    options.noise = rig_.imu_noise;
    options.noise.rate_hz = 1000;
    const SimulatedImu imu = SimulateImu(motion_, options);
    for (int i = 1; i < kFrames; ++i) {
      Preintegration& between =
          imu_.emplace_back(options.noise, Vector3d::Zero(), Vector3d::Zero());
      const double from_s = kFrom_s + (i - 1) * kStep_s;
      for (const ImuSample& sample : imu.samples) {
        const double t_s = ToSeconds(sample.stamp_ns);
        if (t_s > from_s - 1e-6 && t_s < from_s + kStep_s + 1e-6) between.Append(sample);
      }
    }
  }

  StereoMeasurement See(int frame, const Vector3d& p_world) const {
    StereoMeasurement seen;
    std::array<Vector2d, 2> at;
    for (int c = 0; c < 2; ++c) {
      const Vector3d p = (Pose(frame) * geometry_.T_imu_camera[c]).Inverse() * p_world;
      at[c] = p.head<2>() / p.z();
    }
    return {at[0], at[1]};
  }
  StereoLineMeasurement See(int frame, const Vector3d& from, const Vector3d& to) const {
    const StereoMeasurement a = See(frame, from), b = See(frame, to);
    return {{a.left, b.left}, LineSegment{*a.right, *b.right}};
  }

  // Binds a term's blocks, each with the manifold of its kind.
  void Add(std::unique_ptr<Factor> factor, const std::vector<double*>& blocks) {
    Factor* term = factor.release();  // the problem's now
    problem_.AddResidualBlock(term, nullptr, blocks);
    for (int k = 0; k < term->blocks(); ++k) {
      if (term->kind(k).manifold) problem_.SetManifold(blocks[k], term->kind(k).manifold());
    }
  }

  void AddLines(int frame) {
    double* pose = poses_[frame].data();
    for (int k = 0; k < 3; ++k) {
      const Vector3d end = InWorld(k) + 0.6 * AxisDirection(kAxes[k], heading_[0]);
      auto seen = std::make_unique<StructuralLineResidual>(&geometry_, Line(k),
                                                           See(frame, InWorld(k), end));
      if (Line(k).HasHeading()) {
        Add(std::move(seen), {pose, heading_.data(), lines_[k].data()});
      } else {
        Add(std::move(seen), {pose, lines_[k].data()});
      }
    }
    Add(std::make_unique<GeneralLineResidual>(&geometry_, anchor_,
                                              See(frame, InWorld(3), InWorld(3) + direction_)),
        {pose, general_.data()});
  }

  void Build() {
    for (int i = 0; i < kFrames; ++i) {
      AddLines(i);
      for (size_t k = 0; k < points_.size(); ++k) {
        const StereoMeasurement seen = See(i, InWorld(static_cast<int>(k)));
        if (i == 0) {
          Add(std::make_unique<HostPointResidual>(geometry_, seen),
              {calibration_.cameras.data(), points_[k].data()});
        } else {
          Add(std::make_unique<PointResidual>(&geometry_, seen),
              {poses_[0].data(), poses_[i].data(), calibration_.cameras.data(), points_[k].data()});
        }
      }
      if (i == 0) continue;
      Add(std::make_unique<ImuResidual>(&imu_[i - 1]),
          {poses_[i - 1].data(), speed_biases_[i - 1].data(), poses_[i].data(),
           speed_biases_[i].data(), calibration_.imu.data()});
    }
    Add(std::make_unique<PointOnLineResidual>(&geometry_, Line(2), 0.01),
        {poses_[0].data(), lines_[2].data(), points_[2].data()});
    problem_.SetParameterBlockConstant(poses_[0].data());
    problem_.SetParameterBlockConstant(calibration_.imu.data());
    problem_.SetParameterBlockConstant(calibration_.cameras.data());
  }

  void Perturb() {
    for (int i = 1; i < kFrames; ++i) {
      PoseToBlock(RigidTransform(ExpRotation({0.02, -0.01, 0.03}), {0.05, -0.04, 0.03}) * Pose(i),
                  poses_[i].data());
    }
    for (auto& speed_bias : speed_biases_) {
      speed_bias[0] += 0.2;
      speed_bias[4] += 0.01;
    }
    heading_[0] += 0.03;
    for (StructuralLineBlock& line : lines_) line = {line[0] + 0.03, 1.1 * line[1]};
    for (auto& point : points_) point[2] *= 0.9;
    const GeneralLineBlock general = general_;
    const double delta[] = {0.03, -0.02, 0.01, 0.02};
    BlockPlus(kGeneralLineKind, general.data(), delta, general_.data());
  }

  static ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;  // blocks of a kind share one
    return options;
  }

  const Rig rig_ = ExampleStereoRig();
  CalibrationState calibration_;
  const MotionSpline motion_ = ExampleFlight(rig_, 5, 1);
  const StereoGeometry geometry_{rig_.T_imu_camera, 900};
  const Vector3d anchor_ = (Pose(0) * geometry_.T_imu_camera[0]).translation;
  const Vector3d direction_{0.3, -0.2, 0.25};
  std::vector<Preintegration> imu_;
  std::array<std::array<double, kPoseSize>, kFrames> poses_;
  std::array<std::array<double, kSpeedBiasSize>, kFrames> speed_biases_{};
  std::array<double, kHeadingSize> heading_{0.2};
  std::array<StructuralLineBlock, 3> lines_;
  GeneralLineBlock general_;
  std::array<std::array<double, kPointSize>, 12> points_;
  ceres::Problem problem_{ProblemOptions()};
};

TEST_F(CeresProblemTest, FindsPosesLinesAndPointsAgain) {
  const auto lines = lines_;
  Build();
  Perturb();
  ceres::Solver::Options options;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-16;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  ASSERT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();
  EXPECT_GT(summary.initial_cost, 1e3);
  EXPECT_LT(summary.final_cost, 1);
  for (int i = 0; i < kFrames; ++i) {
    const RigidTransform off = Pose(i).Inverse() * PoseFromBlock(poses_[i].data());
    EXPECT_LT(off.translation.norm(), 1e-3) << i;
    EXPECT_LT(LogRotation(off.rotation).norm(), 1e-3) << i;
  }
  EXPECT_NEAR(heading_[0], 0.2, 1e-3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT((CrossingPoint(Line(k), heading_[0], lines_[k].data()) -
               CrossingPoint(Line(k), 0.2, lines[k].data()))
                  .norm(),
              1e-3);
  }
  const Vector3d direction = GeneralLineFromBlock(anchor_, general_.data()).direction_world;
  EXPECT_LT(direction.cross(direction_.normalized()).norm(), 1e-3);
}

}  // namespace
}  // namespace slcmap
