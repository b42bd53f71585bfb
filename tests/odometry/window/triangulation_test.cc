#include <gtest/gtest.h>

#include "odometry/window/point_landmarks.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

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

  StereoGeometry geometry_{ExampleStereoRig().T_imu_camera, 600};
  RigidTransform pose_{Eigen::Quaterniond::Identity(), {0, 0, 0}};
  Eigen::Vector3d p_world_ = geometry_.T_imu_camera[0] * Eigen::Vector3d(0.5, -0.3, 4.0);
  FrameState a_, b_;
  PointLandmark landmark_;
  double depth_m_ = 0;
};

TEST_F(TriangulationTest, FindsTheDepthFromOneStereoPair) {
  See(&a_, pose_, true);
  const auto inverse = TriangulateInverseDepth(landmark_, geometry_, {});
  ASSERT_TRUE(inverse.has_value());
  EXPECT_NEAR(1 / *inverse, depth_m_, 1e-6);
}

TEST_F(TriangulationTest, FindsTheDepthFromMotionAlone) {
  See(&a_, pose_, false);
  See(&b_, {ExpRotation({0.02, 0.1, 0}), {0.3, 0.2, 0.1}}, false);
  const auto inverse = TriangulateInverseDepth(landmark_, geometry_, {});
  ASSERT_TRUE(inverse.has_value());
  EXPECT_NEAR(1 / *inverse, depth_m_, 1e-6);
}

TEST_F(TriangulationTest, RefusesParallelRays) {
  See(&a_, pose_, false);
  See(&b_, {ExpRotation({0.02, 0.1, 0}), {0.001, 0, 0}}, false);
  EXPECT_FALSE(TriangulateInverseDepth(landmark_, geometry_, {}).has_value());
}

TEST_F(TriangulationTest, RefusesMeasurementsThatDoNotMeet) {
  See(&a_, pose_, true);
  a_.measurements[1].right->y() += 0.1;
  EXPECT_FALSE(TriangulateInverseDepth(landmark_, geometry_, {}).has_value());
}

TEST_F(TriangulationTest, RefusesAPointBehindTheCamera) {
  See(&a_, pose_, true);
  a_.measurements[1].right->x() = 2 * a_.measurements[1].left.x() - a_.measurements[1].right->x();
  EXPECT_FALSE(TriangulateInverseDepth(landmark_, geometry_, {}).has_value());
}

}  // namespace
}  // namespace slcmap
