// Rows that are exposed before or after the stamp.
#include "odometry/geometry/exposure.h"

#include <gtest/gtest.h>

#include "odometry/frontend/rectifier.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const BodyMotion kMotion{{0.4, -1.1, 0.7}, {3, 2, -4}, {0.8, -0.5, 0.3}, {1.5, -2, 1}};

Rig RollingRig() {
  Rig rig = ExampleStereoRig();
  rig.readout_s = {0.02, -0.01};
  rig.right_time_offset_s = 0.008;
  return rig;
}

TimedPlace See(const Vector3d& p_body, const RigidTransform& T_body_camera, double after_s) {
  return {((kMotion.At(after_s) * T_body_camera).Inverse() * p_body).hnormalized(), after_s};
}

TEST(RowTimes, AreThoseOfTheRowsThatWereRecorded) {
  Rig rig = RollingRig();
  for (Camera& camera : rig.cameras) {
    camera.distortion = Distortion::kRadialTangential;
    camera.coefficients << -0.283, 0.074, 0.0002, 1.8e-5;
  }
  rig.T_imu_camera[1].rotation = rig.T_imu_camera[1].rotation * ExpRotation({0.01, 0, 0.02});
  const Rectifier rectifier(rig, {});
  const RowTimes times(rig, rectifier.rectified_rig());
  EXPECT_FALSE(times.at_once());
  EXPECT_NEAR(times.reach_s(), 0.013, 1e-12);
  for (const int camera : {0, 1}) {
    const Vector2d recorded_px(300, 77);
    const Vector3d ray =
        rig.T_imu_camera[camera].rotation * *rig.cameras[camera].Unproject(recorded_px);
    const Vector3d rectified =
        rectifier.rectified_rig().T_imu_camera[camera].rotation.conjugate() * ray;
    const double expected_s =
        (camera == 0 ? 0.02 : -0.01) * (77.5 / 480 - 0.5) + (camera == 0 ? 0 : 0.008);
    EXPECT_NEAR(times.Of(camera, rectified.hnormalized()).after_s, expected_s, 1e-7);
  }
  EXPECT_TRUE(RowTimes(ExampleStereoRig(), ExampleStereoRig()).at_once());
}

TEST(BodyMotion, IsThatOfTheMotionItWasFeltIn) {
  constexpr int64_t kStamp_ns = 5'000'000'000;
  const MotionSpline motion = ExampleFlight(ExampleStereoRig(), 8);
  ImuSimulatorOptions options;
  options.with_noise = false;
  ImuBuffer imu;
  for (const ImuSample& sample : SimulateImu(motion, options).samples) imu.Add(sample);
  const FeltMotion felt = FeltAround(imu, kStamp_ns, 0.01);
  const RigidTransform T_world_imu = motion.PoseAt(5);
  const Eigen::Quaterniond R_imu_world = T_world_imu.rotation.conjugate();
  const BodyMotion body{felt.rate_rad_s, felt.rate_change_rad_s2,
                        R_imu_world * motion.VelocityAt(5),
                        felt.force_m_s2 + R_imu_world * Vector3d(0, 0, -kGravity_m_s2)};
  for (const double after_s : {-0.02, -0.01, 0.0, 0.01, 0.02}) {
    const RigidTransform error =
        (T_world_imu * body.At(after_s)).Inverse() * motion.PoseAt(5 + after_s);
    EXPECT_LT(error.translation.norm(), 2e-5) << after_s;
    EXPECT_LT(LogRotation(error.rotation).norm(), 1e-4) << after_s;
  }
}

TEST(AtMoment, HasTheResidualOfTheMeasurementsOwnTime) {
  const Rig rig = RollingRig();
  const Vector3d p_body = rig.T_imu_camera[0] * Vector3d(0.7, -0.4, 2.1);
  const Vector2d error(0.003, -0.002);
  for (const int camera : {0, 1}) {
    const RigidTransform& T_body_camera = rig.T_imu_camera[camera];
    for (const double after_s : {-0.01, 0.0, 0.013}) {
      TimedPlace seen = See(p_body, T_body_camera, after_s);
      const Vector2d then = See(p_body, T_body_camera, 0).on_plane;
      const double inverse_depth =
          1 / ((kMotion.At(after_s) * T_body_camera).Inverse() * p_body).z();
      EXPECT_LT((AtMoment(seen, T_body_camera, kMotion, inverse_depth) - then).norm(), 1e-12);
      seen.on_plane += error;
      const auto placed = AtMoment(seen, T_body_camera, kMotion, p_body);
      ASSERT_TRUE(placed);
      EXPECT_LT((*placed - then - error).norm(), 1e-12) << after_s;
    }
    EXPECT_FALSE(AtMoment({}, T_body_camera, kMotion, T_body_camera * Vector3d(0, 0, -1)));
  }
}

TEST(InverseDepth, IsToldByImagesOfTwoTimes) {
  const Rig rig = RollingRig();
  const Vector3d p_body = rig.T_imu_camera[0] * Vector3d(0.7, -0.4, 2.1);
  const TimedPlace left = See(p_body, rig.T_imu_camera[0], -0.004);
  const TimedPlace right = See(p_body, rig.T_imu_camera[1], 0.009);
  const double depth_m = ((kMotion.At(-0.004) * rig.T_imu_camera[0]).Inverse() * p_body).z();
  EXPECT_NEAR(InverseDepth(left, right, rig.T_imu_camera[0], rig.T_imu_camera[1], kMotion),
              1 / depth_m, 1e-9);
}

}  // namespace
}  // namespace slcmap
