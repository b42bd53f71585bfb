#include <gtest/gtest.h>

#include <random>

#include "odometry/factors/factor.h"
#include "odometry/window/line_triangulation.h"
#include "odometry/window/point_landmarks.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class TriangulationTest : public ::testing::Test {
 protected:
  void See(FrameState* frame, const RigidTransform& pose, bool right) {
    PoseToBlock(pose, frame->pose.data());
    StereoMeasurement& measurement = frame->measurements[1];
    for (int c = 0; c < (right ? 2 : 1); ++c) {
      const Eigen::Vector3d p = (pose * geometry_.T_imu_camera[c]).Inverse() * p_world_;
      const Eigen::Vector2d on_plane = p.head<2>() / p.z();
      if (c == 0) measurement.left = on_plane;
      if (c == 1) measurement.right = on_plane;
      if (c == 0 && landmark_.frames.empty()) depth_m_ = p.z();
    }
    landmark_.id = 1;
    landmark_.frames.push_back(frame);
  }

  std::optional<double> Depth_m() const {
    const auto inverse = TriangulateInverseDepth(landmark_, geometry_, {});
    if (!inverse) return std::nullopt;
    return 1 / *inverse;
  }

  StereoGeometry geometry_{ExampleStereoRig().T_imu_camera, 600};
  RigidTransform pose_{Eigen::Quaterniond::Identity(), {0, 0, 0}};
  Eigen::Vector3d p_world_ = geometry_.T_imu_camera[0] * Eigen::Vector3d(0.5, -0.3, 4.0);
  FrameState a_, b_;
  PointLandmark landmark_;
  double depth_m_ = 0;
};

TEST_F(TriangulationTest, FindsTheDepthFromOneStereoPairWhoseRaysMeetBeforeIt) {
  See(&a_, pose_, true);
  ASSERT_TRUE(Depth_m());
  EXPECT_NEAR(*Depth_m(), depth_m_, 1e-6);
  const Vector2d left = a_.measurements[1].left, right = *a_.measurements[1].right;
  a_.measurements[1].right = right + Vector2d(0, 0.1);
  EXPECT_FALSE(Depth_m()) << "they pass each other";
  a_.measurements[1].right = Vector2d(2 * left.x() - right.x(), right.y());
  EXPECT_FALSE(Depth_m()) << "they meet behind it";
}

TEST_F(TriangulationTest, FindsTheDepthFromMotionAloneWhereItIsEnough) {
  See(&a_, pose_, false);
  See(&b_, {ExpRotation({0.02, 0.1, 0}), {0.3, 0.2, 0.1}}, false);
  ASSERT_TRUE(Depth_m());
  EXPECT_NEAR(*Depth_m(), depth_m_, 1e-6);
  landmark_.frames.pop_back();
  See(&b_, {ExpRotation({0.02, 0.1, 0}), {0.001, 0, 0}}, false);
  EXPECT_FALSE(Depth_m()) << "parallel rays";
}

constexpr double kFocal_px = 450, kSigma_px = 1, kHeading = 0.2;

class LineTriangulationTest : public ::testing::Test {
 protected:
  StereoGeometry geometry_{ExampleStereoRig().T_imu_camera, kFocal_px / kSigma_px};
  RigidTransform first_{ExpRotation({0.1, 0.05, 0.3}), {4, -3, 1}};
  Vector3d anchor_ = (first_ * geometry_.T_imu_camera[0]).translation;
  std::mt19937_64 generator_{7};

  // What lies at p in the first left camera.
  Vector3d InWorld(const Vector3d& p_camera) const {
    return first_ * (geometry_.T_imu_camera[0] * p_camera);
  }
  // The k-th pose of a camera that moves sideways, down and ahead.
  RigidTransform Pose(int k) const {
    return first_ *
           RigidTransform(ExpRotation({0.01 * k, -0.02 * k, 0.01 * k}),
                          geometry_.R_imu_camera[0] * Vector3d(0.15 * k, 0.2 * k, 0.08 * k));
  }
  // An observation of the segment from a to b. Its ends are noisy by sigma_px across it, and each
  // pair sees another part of it.
  PosedLineObservation See(int k, const Vector3d& a, const Vector3d& b, bool right,
                           double sigma_px) {
    std::normal_distribution<double> noise(0, sigma_px / kFocal_px);
    PosedLineObservation observation{Pose(k), {}};
    const auto seen = [&](int camera) {
      const RigidTransform T = (observation.T_world_imu * geometry_.T_imu_camera[camera]).Inverse();
      const double shift = 0.03 * k + 0.02 * camera;
      const Vector3d p = T * Vector3d(a + shift * (b - a)), q = T * Vector3d(b - shift * (b - a));
      const Vector2d s = p.head<2>() / p.z(), e = q.head<2>() / q.z();
      const Vector2d across = Vector2d(s.y() - e.y(), e.x() - s.x()).normalized();
      return LineSegment{s + noise(generator_) * across, e + noise(generator_) * across};
    };
    observation.measurement.left = seen(0);
    if (right) observation.measurement.right = seen(1);
    return observation;
  }
  std::vector<PosedLineObservation> SeeAll(int count, const Vector3d& a, const Vector3d& b,
                                           bool right, double sigma_px) {
    std::vector<PosedLineObservation> observations;
    for (int k = 0; k < count; ++k) observations.push_back(See(k, a, b, right, sigma_px));
    return observations;
  }
  static double DistanceOfPoint(const Vector3d& p, const PointAndDirection& line) {
    return (p - line.point_world).cross(line.direction_world).norm();
  }

  std::optional<StructuralLineFit> FitStructural(
      const std::vector<PosedLineObservation>& observations, LineAxis axis = LineAxis::kVertical) {
    return TriangulateStructuralLine(observations, {axis, anchor_}, kHeading, geometry_, {});
  }
  // Of a fit from the line through start_.
  double Error_m(const std::optional<StructuralLineFit>& fit, LineAxis axis = LineAxis::kVertical) {
    if (!fit) return 1e9;
    const Vector3d crossing = CrossingPoint({axis, anchor_}, kHeading, fit->block.data());
    return DistanceOfPoint(start_, {crossing, AxisDirection(axis, kHeading)});
  }

  // Of a vertical line, and of a general one.
  const Vector3d start_ = InWorld({0.5, -0.3, 4}), end_ = start_ + Vector3d::UnitZ();
  const Vector3d general_end_ = InWorld({-0.4, 0.6, 5});
};

TEST_F(LineTriangulationTest, FindsStructuralLinesExactly) {
  for (const LineAxis axis : {LineAxis::kX, LineAxis::kY, LineAxis::kVertical}) {
    const Vector3d end = start_ + 0.8 * AxisDirection(axis, kHeading);
    EXPECT_LT(Error_m(FitStructural(SeeAll(4, start_, end, true, 0), axis), axis), 1e-6);
  }
  EXPECT_LT(Error_m(FitStructural({See(0, start_, end_, true, 0)})), 1e-6) << "of one pair";
}

TEST_F(LineTriangulationTest, RefusesALineOfOneViewTooFarOrBehindTheCamera) {
  const Vector3d far = InWorld({5, -3, 80}), far_end = far + Vector3d(0, 0, 10);
  // Left and right exchanged, the rays part.
  PosedLineObservation behind = See(0, start_, end_, true, 0);
  std::swap(behind.measurement.left, *behind.measurement.right);
  for (const PosedLineObservation& observation :
       {See(0, start_, end_, false, 0), See(0, far, far_end, true, 0), behind}) {
    EXPECT_FALSE(FitStructural({observation}));
    EXPECT_FALSE(TriangulateGeneralLine({observation}, anchor_, geometry_, {}));
  }
}

TEST_F(LineTriangulationTest, FindsGeneralLinesExactly) {
  const auto observations = SeeAll(4, start_, general_end_, true, 0);
  const auto fit = TriangulateGeneralLine(observations, anchor_, geometry_, {});
  ASSERT_TRUE(fit.has_value());
  const PointAndDirection line = GeneralLineFromBlock(anchor_, fit->block.data());
  EXPECT_LT(DistanceOfPoint(start_, line) + DistanceOfPoint(general_end_, line), 1e-6);
}

// The share of the true error's squared length that the covariance tells: one a dimension, on
// average.
TEST_F(LineTriangulationTest, TellsItsOwnErrors) {
  const StructuralLine line{LineAxis::kY, anchor_};
  const Vector3d a = start_, b = a + AxisDirection(LineAxis::kY, kHeading);
  const StructuralLineBlock truth = StructuralLineThrough(line, kHeading, a);
  const GeneralLineBlock general_truth = GeneralLineThrough(anchor_, a, b - a);
  const Vector3d direction = (b - a).normalized();
  constexpr int kRuns = 200;
  double structural = 0, general = 0, turned = 0;
  LineTriangulationOptions options;
  options.loss_sigma = 100;  // the covariance of a robust fit is not that of least squares
  for (int run = 0; run < kRuns; ++run) {
    const auto observations = SeeAll(6, a, b, true, kSigma_px);
    const auto fit = TriangulateStructuralLine(observations, line, kHeading, geometry_, options);
    ASSERT_TRUE(fit.has_value());
    const Vector2d off =
        Eigen::Map<const Vector2d>(fit->block.data()) - Eigen::Map<const Vector2d>(truth.data());
    structural += off.dot(fit->covariance.inverse() * off) / 2 / kRuns;
    const auto free = TriangulateGeneralLine(observations, anchor_, geometry_, options);
    ASSERT_TRUE(free.has_value());
    GeneralLineBlock same = general_truth;
    const PointAndDirection found = GeneralLineFromBlock(anchor_, free->block.data());
    if (found.direction_world.dot(direction) < 0) same = GeneralLineThrough(anchor_, a, a - b);
    Eigen::Vector4d d;
    BlockMinus(kGeneralLineKind, same.data(), free->block.data(), d.data());
    general += d.dot(free->covariance.inverse() * d) / 4 / kRuns;
    const Vector3d turn = direction.cross(found.direction_world);
    turned += turn.squaredNorm() / free->direction_covariance.trace() / kRuns;
  }
  EXPECT_NEAR(structural, 1, 0.2);
  EXPECT_NEAR(general, 1, 0.2);
  EXPECT_NEAR(turned, 1, 0.3);
}

TEST_F(LineTriangulationTest, OneWrongObservationDoesLittleHarm) {
  auto observations = SeeAll(7, start_, end_, true, 0.3);
  const Vector3d aside = InWorld({0.62, -0.3, 4});
  observations[5] = See(5, aside, aside + Vector3d::UnitZ(), true, 0.3);
  EXPECT_LT(Error_m(FitStructural(observations)), 0.03);
}

TEST_F(LineTriangulationTest, TellsHowFarALineWasSeen) {
  const Vector3d a = start_, b = general_end_;
  const PointAndDirection line{a, (b - a).normalized()};
  const RigidTransform T_world_camera = first_ * geometry_.T_imu_camera[0];
  const LineSegment segment = See(0, a, b, false, 0).measurement.left;
  for (const LineSegment& seen : {segment, LineSegment{segment.end, segment.start}}) {
    const auto extent = ExtentAlong(line, seen, T_world_camera);
    ASSERT_TRUE(extent.has_value());
    EXPECT_NEAR(extent->first, 0, 1e-9);
    EXPECT_NEAR(extent->second, (b - a).norm(), 1e-9);
  }
  const PointAndDirection behind{T_world_camera * Vector3d(0.5, -0.3, -4), line.direction_world};
  EXPECT_FALSE(ExtentAlong(behind, segment, T_world_camera).has_value());
  const Vector3d along_ray =
      T_world_camera.rotation * Vector3d(segment.start.x(), segment.start.y(), 1);
  EXPECT_FALSE(ExtentAlong({a, along_ray.normalized()}, segment, T_world_camera).has_value());
}

}  // namespace
}  // namespace slcmap
