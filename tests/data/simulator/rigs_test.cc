#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "data/simulator/simulation.h"

namespace slcmap {
namespace {

double BaselineOf(const Rig& rig) {
  return (rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]).translation.x();
}

TEST(ReadSimulatedRig, KnowsThePublishedRigs) {
  const Rig euroc = ReadSimulatedRig("euroc");
  EXPECT_EQ(euroc.cameras[0].distortion, Distortion::kRadialTangential);
  EXPECT_EQ(euroc.cameras[1].fx_px, 457.587);
  EXPECT_NEAR(BaselineOf(euroc), 0.110, 0.001);
  EXPECT_EQ(euroc.imu_noise.gyro_noise_rad_s_sqrthz, 1.6968e-4);
  const Rig tumvi = ReadSimulatedRig("tumvi");
  EXPECT_EQ(tumvi.cameras[0].distortion, Distortion::kEquidistant);
  EXPECT_EQ(tumvi.cameras[0].width_px, 512);
  EXPECT_NEAR(BaselineOf(tumvi), 0.101, 0.001);
  EXPECT_EQ(tumvi.imu_noise.accel_walk_m_s3_sqrthz, 8.6e-4);
}

TEST(ReadSimulatedRig, RefusesUnknownNames) {
  EXPECT_THROW(ReadSimulatedRig("kitti"), ConfigError);
}

TEST(ImuModelFromName, KnowsTheModelsAndRefusesOthers) {
  EXPECT_EQ(ImuModelFromName("bmi160").noise.gyro_noise_rad_s_sqrthz, 1.6e-4);
  EXPECT_FALSE(ImuModelFromName("perfect").with_noise);
  EXPECT_THROW(ImuModelFromName("gyroscope"), ConfigError);
}

TEST(MisreadingImu, IsOffByWhatItSays) {
  const ImuCorrection correction = MisreadingImu(0.03, -0.02, 0.5, 7);
  const double off_rad = 0.5 * 3.14159265 / 180;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d accel = correction.accel.inverse().row(axis);
    EXPECT_NEAR(accel.norm(), 1.03, 1e-12);
    EXPECT_NEAR(std::acos(std::min(1.0, accel.normalized()[axis])), axis == 0 ? 0 : off_rad, 1e-6);
    EXPECT_NEAR(Eigen::Vector3d(correction.gyro.inverse().row(axis)).norm(), 0.98, 1e-12);
  }
  EXPECT_NE(MisreadingImu(0.03, -0.02, 0.5, 8).accel, correction.accel);
}

TEST(Miscalibrated, DiffersByWhatItSays) {
  const Rig rig = ReadSimulatedRig("euroc");
  double focal = 0, mounting_rad = 0, between_rad = 0;
  const int count = 200;
  for (int seed = 0; seed < count; ++seed) {
    const Rig wrong = Miscalibrated(rig, 2.0, seed);
    focal += std::pow(wrong.cameras[0].fx_px / rig.cameras[0].fx_px - 1, 2);
    const auto turn = [&](int c) {
      return wrong.T_imu_camera[c].rotation * rig.T_imu_camera[c].rotation.conjugate();
    };
    mounting_rad += LogRotation(turn(0)).squaredNorm();
    between_rad += LogRotation(turn(0).conjugate() * turn(1)).squaredNorm();
  }
  const double degree = 3.14159265 / 180;
  EXPECT_NEAR(std::sqrt(focal / count), 0.006, 0.001);
  EXPECT_NEAR(std::sqrt(mounting_rad / (3 * count)), 0.6 * degree, 0.1 * degree);
  EXPECT_NEAR(std::sqrt(between_rad / (3 * count)), 0.1 * degree, 0.02 * degree);
  EXPECT_EQ(Miscalibrated(rig, 0, 1).cameras[1].cx_px, rig.cameras[1].cx_px);
}

}  // namespace
}  // namespace slcmap
