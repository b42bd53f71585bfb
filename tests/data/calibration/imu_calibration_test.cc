#include "data/calibration/imu_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/source/sequence.h"
#include "tests/testing/caught.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TempFolder;

// A chain as Kalibr writes it after a calibration with the IMU.
const char* const kCamera =
    "  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.01]\n  - [0.0, 0.0, -1.0, 0.02]\n"
    "  - [1.0, 0.0, 0.0, -0.03]\n  - [0.0, 0.0, 0.0, 1.0]\n"
    "  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]\n"
    "  distortion_model: radtan\n  intrinsics: [400.0, 400.0, 320.0, 240.0]\n"
    "  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.012\n";
const char* const kNoise =
    "  accelerometer_noise_density: 0.002\n  accelerometer_random_walk: 0.003\n"
    "  gyroscope_noise_density: 0.00017\n  gyroscope_random_walk: 0.00002\n"
    "  rostopic: /imu0\n  update_rate: 200.0\n";
const char* const kIdentity4 =
    "  T_i_b:\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n  time_offset: 0.0\n";
const char* const kZeros = "[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]\n";
const char* const kAccel = "[[1.03, 0.0, 0.0], [0.01, 0.98, 0.0], [-0.02, 0.005, 1.01]]\n";
const char* const kGyro = "[[0.97, 0.0, 0.0], [0.004, 1.02, 0.0], [0.0, -0.01, 1.0]]\n";
const char* const kTurn = "[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]\n";

// The keys of imu0 that tell of its errors, as Kalibr writes them.
std::string KalibrKeys(const std::string& a = kZeros, const std::string& levers = "") {
  return std::string("  model: scale-misalignment\n  accelerometers:\n    M: ") + kAccel + levers +
         "  gyroscopes:\n    A: " + a + "    C_gyro_i: " + kTurn + "    M: " + kGyro;
}

Rig ReadWith(const std::string& imu_keys, const std::string& camera_keys = "") {
  const TempFolder folder;
  const std::string chain =
      folder.Write("camchain.yaml", "%YAML:1.0\ncam0:\n" + std::string(kCamera) + camera_keys);
  const std::string imu =
      folder.Write("imu.yaml", "%YAML:1.0 # OpenVINS'\n\nimu0:\n" + std::string(kNoise) + imu_keys);
  Warnings warnings;
  return ReadKalibrCalibration(chain, imu, &warnings).rig;
}

InputFault FaultWith(const std::string& imu_keys, const std::string& camera_keys = "") {
  return testing::Caught<InputFault>([&] { ReadWith(imu_keys, camera_keys); });
}

void ExpectCorrected(const Rig& rig) {
  Eigen::Matrix3d accel, gyro, turn;
  accel << 1.03, 0, 0, 0.01, 0.98, 0, -0.02, 0.005, 1.01;
  gyro << 0.97, 0, 0, 0.004, 1.02, 0, 0, -0.01, 1;
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Vector3d force(0.3, -2, 9.5), turning(0.2, -0.1, 0.4);
  std::vector<ImuSample> samples{{0, gyro * turn * turning, accel * force}};
  Correct(rig.imu_correction, &samples);
  EXPECT_LT((samples[0].specific_force_m_s2 - force).norm(), 1e-12);
  EXPECT_LT((samples[0].angular_velocity_rad_s - turning).norm(), 1e-12);
}

TEST(ImuCorrection, KalibrsAndOpenVinsKeysMeanTheSame) {
  ExpectCorrected(ReadWith(kIdentity4 + KalibrKeys()));
  ExpectCorrected(ReadWith(KalibrKeys(kZeros,
                                      "    rx_i: [0.0, 0.0, 0.0]\n    ry_i: [0, 0, 0]\n"
                                      "    rz_i: [0, 0, 0]\n")));
  const std::string identity = "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n";
  ExpectCorrected(ReadWith(std::string(kIdentity4) + "  model: \"kalibr\"\n  Tw: " + kGyro +
                           "  R_IMUtoGYRO: " + kTurn + "  Ta: " + kAccel +
                           "  R_IMUtoACC: " + identity + "  Tg: " + kZeros));
  EXPECT_TRUE(IsIdentity(ReadWith(std::string(kIdentity4) + "  model: kalibr\n  Tw: " + identity +
                                  "  R_IMUtoGYRO: " + identity + "  Ta: " + identity +
                                  "  R_IMUtoACC: " + identity + "  Tg: " + kZeros)
                             .imu_correction));
  EXPECT_TRUE(IsIdentity(ReadWith("  model: calibrated\n").imu_correction));
}

TEST(ImuCorrection, TheImusFrameAndClockAreThoseOfItsSamples) {
  const Rig plain = ReadWith("");
  const Rig moved = ReadWith(
      "  T_i_b:\n  - [0.0, -1.0, 0.0, 0.1]\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
      "  - [0.0, 0.0, 0.0, 1.0]\n  time_offset: 0.005\n");
  Eigen::Matrix4d T_imu_body;
  T_imu_body << 0, -1, 0, 0.1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_LT((moved.T_imu_camera[0].Matrix() - T_imu_body * plain.T_imu_camera[0].Matrix()).norm(),
            1e-12);
  EXPECT_EQ(plain.camera_time_offset_s, 0.012);
  EXPECT_NEAR(moved.camera_time_offset_s, 0.007, 1e-15);
}

TEST(ImuCorrection, WhatIsNotModelledIsRefusedByName) {
  const std::string felt = "[[0.0, 0.0, 0.001], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]\n";
  const InputFault kalibr = FaultWith(KalibrKeys(felt));
  EXPECT_THAT(kalibr.what(), AllOf(HasSubstr("imu.yaml: imu0.gyroscopes: A: found a gyroscope that "
                                             "feels forces, by up to 0.0098 rad/s")));
  EXPECT_THAT(kalibr.remedy(), HasSubstr("write zeros as imu0.gyroscopes.A in "));
  EXPECT_THAT(FaultWith("  Tg: " + felt).what(), HasSubstr("imu0: Tg: found a gyroscope"));
  const InputFault lever = FaultWith(KalibrKeys(kZeros, "    ry_i: [0.0, 0.01, 0.0]\n"));
  EXPECT_THAT(lever.what(), HasSubstr("ry_i: found an axis of the accelerometer"));
  EXPECT_THAT(lever.remedy(), HasSubstr("scale-misalignment"));
}

TEST(ImuCorrection, AbsurdMatricesAreNamed) {
  EXPECT_THAT(FaultWith("  Ta: [[9.81, 0, 0], [0, 9.81, 0], [0, 0, 9.81]]\n").what(),
              HasSubstr("imu0: Ta: found a matrix that scales by 9.81"));
  EXPECT_THAT(FaultWith(std::string("  Tw: ") + kZeros).what(), HasSubstr("scales by 0 to 0"));
  EXPECT_THAT(FaultWith("  R_IMUtoGYRO: [[1, 0, 0], [0, 2, 0], [0, 0, 1]]\n").what(),
              HasSubstr("R_IMUtoGYRO: found a matrix that is not a rotation"));
  EXPECT_THAT(FaultWith("  Ta: [[1, 0], [0, 1]]\n").what(),
              HasSubstr("found 2 rows, expected 3 rows of 3"));
  EXPECT_THAT(FaultWith(KalibrKeys() + "  Ta: " + kAccel).what(), HasSubstr("one of the forms"));
  EXPECT_THAT(FaultWith("  model: scale-misalignment\n").what(),
              HasSubstr("accelerometers: found no M, expected it as model is scale-misalignment"));
  EXPECT_THAT(FaultWith("  time_offset: 30\n").what(), HasSubstr("time_offset: found 30 s"));
}

TEST(CalibrationKeys, AnUnknownOneIsNamedWithTheNearest) {
  const InputFault imu = FaultWith("  gyroscope_noise_densty: 3\n");
  EXPECT_THAT(imu.what(), AllOf(HasSubstr("imu.yaml: imu0.gyroscope_noise_densty: unknown key"),
                                HasSubstr("did you mean 'gyroscope_noise_density'?")));
  EXPECT_THAT(imu.remedy(), HasSubstr("correct or remove"));
  EXPECT_THAT(FaultWith("", "  timeshift_cam_imu_s: 3\n").what(),
              AllOf(HasSubstr("camchain.yaml: cam0.timeshift_cam_imu_s: unknown key"),
                    HasSubstr("did you mean 'timeshift_cam_imu'?")));
  EXPECT_THAT(FaultWith("  accelerometers: {m: " + std::string(kAccel) + "}\n").what(),
              HasSubstr("did you mean 'M'?"));
  EXPECT_THAT(FaultWith("cameras: 2\n").what(), HasSubstr("cameras: unknown key"));
}

TEST(CalibrationKeys, OfSensorFilesToo) {
  for (const std::string file : {"cam0", "imu0"}) {
    const TempFolder folder;
    testing::WriteSequence(folder, {.images = 2});
    const std::string path = "mav0/" + file + "/sensor.yaml";
    const std::string text = testing::ReadText(folder.Path(path));
    folder.Write(path, text + "comment: VI-Sensor\n");
    Warnings warnings;
    EXPECT_NO_THROW(ReadAslCalibration(folder.Path("mav0"), &warnings));
    folder.Write(path, text + "rate_khz: 3\n");
    EXPECT_THAT(
        testing::MessageOf<DataError>([&] { ReadAslCalibration(folder.Path("mav0"), &warnings); }),
        AllOf(HasSubstr(path + ": rate_khz: unknown key"), HasSubstr("did you mean 'rate_hz'?")));
  }
}

TEST(ImuCorrection, IsWrittenReadAgainAndAppliedOnce) {
  const Rig rig = ReadWith(KalibrKeys());
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 3});
  const ImuSample raw = OpenSequence(folder.Path()).imu[0];
  WriteKalibrCalibration(folder.Path("written.yaml"), rig);
  SequenceOptions options;
  options.calibration = folder.Path("written.yaml");
  const Sequence sequence = OpenSequence(folder.Path(), options);
  EXPECT_LT((sequence.rig.imu_correction.gyro - rig.imu_correction.gyro).norm(), 1e-12);
  EXPECT_LT(
      (sequence.imu[0].specific_force_m_s2 - rig.imu_correction.accel * raw.specific_force_m_s2)
          .norm(),
      1e-12);
  EXPECT_THAT(sequence.calibration_source, HasSubstr("IMU's scale and axes corrected"));
}

}  // namespace
}  // namespace slcmap
