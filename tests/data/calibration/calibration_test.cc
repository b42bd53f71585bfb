#include "data/calibration/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"
#include "data/source/sequence.h"
#include "tests/testing/caught.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

// A Kalibr camera with the given transform entries (each line indented by two).
std::string KalibrCamera(const std::string& transforms) {
  return transforms +
         "  cam_overlaps: [1]\n  camera_model: pinhole\n"
         "  distortion_coeffs: [0.0034, 0.0007, -0.002, 0.0002]\n"
         "  distortion_model: equidistant\n  intrinsics: [190.9, 190.9, 254.9, 256.8]\n"
         "  resolution: [512, 512]\n  rostopic: /cam/image_raw\n  timeshift_cam_imu: 0.0012\n";
}

std::string Rows(const std::string& key, const RigidTransform& transform) {
  const Eigen::Matrix4d m = transform.Matrix();
  std::string text = "  " + key + ":\n";
  for (int i = 0; i < 4; ++i) {
    text += fmt::format("  - [{:.15f}, {:.15f}, {:.15f}, {:.15f}]\n", m(i, 0), m(i, 1), m(i, 2),
                        m(i, 3));
  }
  return text;
}

const RigidTransform kLeft{ExpRotation({-1.2, 0.1, 0.3}), {0.05, -0.06, 0.04}};  // T_imu_cam0
const RigidTransform kRight = kLeft * RigidTransform{ExpRotation({0.01, 0, 0}), {0.1, 0, 0}};

std::string Chain(const std::string& left, const std::string& right) {
  return "cam0:\n" + KalibrCamera(left) + "cam1:\n" + KalibrCamera(right);
}

Calibration ReadChain(const std::string& left, const std::string& right) {
  const TempFolder folder;
  const std::string path = folder.Write("camchain.yaml", Chain(left, right));
  const std::string imu = folder.Write(
      "imu.yaml",
      "accelerometer_noise_density: 0.0014\naccelerometer_random_walk: 0.000086\n"
      "gyroscope_noise_density: 0.00008\ngyroscope_random_walk: 2.2e-06\nupdate_rate: 200.0\n");
  Warnings warnings;
  return ReadKalibrCalibration(path, imu, &warnings);
}

void ExpectPoses(const Calibration& calibration) {
  const auto& poses = calibration.rig.T_imu_camera;
  EXPECT_LT((poses[0].Matrix() - kLeft.Matrix()).norm(), 1e-9);
  EXPECT_LT((poses[1].Matrix() - kRight.Matrix()).norm(), 1e-9);
}

TEST(KalibrCalibration, BothDirectionsAndTheChainGiveTheSameRig) {
  const Calibration forward =
      ReadChain(Rows("T_cam_imu", kLeft.Inverse()), Rows("T_cam_imu", kRight.Inverse()));
  ExpectPoses(forward);
  EXPECT_EQ(forward.rig.cameras[1].distortion, Distortion::kEquidistant);
  EXPECT_EQ(forward.rig.cameras[0].width_px, 512);
  EXPECT_DOUBLE_EQ(forward.rig.camera_time_offset_s, 0.0012);
  EXPECT_DOUBLE_EQ(forward.rig.imu_noise.accel_noise_m_s2_sqrthz, 0.0014);
  EXPECT_DOUBLE_EQ(forward.rig.imu_noise.gyro_walk_rad_s2_sqrthz, 2.2e-6);
  EXPECT_THAT(forward.source, HasSubstr("T_cam_imu of cam0, T_cam_imu of cam1"));
  const Calibration backward = ReadChain(Rows("T_imu_cam", kLeft), Rows("T_imu_cam", kRight));
  ExpectPoses(backward);
  EXPECT_THAT(backward.source, HasSubstr("T_imu_cam of cam0"));
  const Calibration chain =
      ReadChain(Rows("T_cam_imu", kLeft.Inverse()), Rows("T_cn_cnm1", kRight.Inverse() * kLeft));
  ExpectPoses(chain);
  EXPECT_THAT(chain.source, HasSubstr("T_cn_cnm1 of cam1"));
}

TEST(KalibrCalibration, EntriesThatContradictEachOtherAreAnError) {
  const auto message = [](const std::string& left) {
    return MessageOf<DataError>([&] { ReadChain(left, Rows("T_cam_imu", kRight.Inverse())); });
  };
  EXPECT_THAT(message(Rows("T_cam_imu", kLeft) + Rows("T_imu_cam", kLeft)),
              AllOf(HasSubstr("cam0"), HasSubstr("disagree")));
  EXPECT_THAT(message(""), HasSubstr("cam0: T_cam_imu: missing"));
  EXPECT_THAT(message("  T_cam_imu: [[1, 0, 0, 0, 0, 1, 0, 0], [0, 0, 1, 0, 0, 0, 0, 1]]\n"),
              HasSubstr("cam0: T_cam_imu: found 2 rows, expected 4 rows of 4"));
}

TEST(KalibrCalibration, BothCamerasHaveOneTimeShift) {
  const auto read = [](const std::string& right_shift, Warnings* warnings) {
    const TempFolder folder;
    std::string right = KalibrCamera(Rows("T_imu_cam", kRight));
    right.replace(right.find("0.0012"), 6, right_shift);
    return ReadKalibrCalibration(
        folder.Write("camchain.yaml",
                     "cam0:\n" + KalibrCamera(Rows("T_imu_cam", kLeft)) + "cam1:\n" + right),
        folder.Write("imu.yaml", testing::kImuYaml), warnings);
  };
  Warnings same, near, far;
  EXPECT_EQ(read("0.0012", &same).rig.camera_time_offset_s, 0.0012);
  EXPECT_EQ(same.Count(kTimeShiftsDiffer), 0);
  EXPECT_EQ(read("0.0017", &near).rig.camera_time_offset_s, 0.0012);
  EXPECT_EQ(near.Count(kTimeShiftsDiffer), 1);
  // Further apart: images of two times.
  const Rig later = read("0.0092", &far).rig;
  EXPECT_EQ(later.camera_time_offset_s, 0.0012);
  EXPECT_NEAR(later.right_time_offset_s, 0.008, 1e-12);
  const auto fault = testing::Caught<InputFault>([&] { read("-0.053", &far); });
  EXPECT_THAT(
      fault.what(),
      HasSubstr("cam1: timeshift_cam_imu: found -0.053 s, expected that of cam0, 0.0012 s"));
  EXPECT_THAT(fault.remedy(), HasSubstr("cam1.timeshift_cam_imu in "));
}

TEST(KalibrCalibration, IsFoundBesideAnAslFolderWithoutSensorFiles) {
  const TempFolder folder;
  const std::string chain = Chain(Rows("T_imu_cam", kLeft), Rows("T_imu_cam", kRight));
  folder.Write("mav0/cam0/data.csv", "");
  const std::string path = folder.Write("dso/camchain.yaml", chain);
  folder.Write("dso/imu_config.yaml", testing::kImuYaml);
  Warnings warnings;
  ExpectPoses(FindCalibration(folder.Path("mav0"), &warnings));
  EXPECT_TRUE(warnings.entries().empty());
  ExpectPoses(ReadCalibration(path, &warnings));
  // OpenCV's first line is no obstacle.
  folder.Write("dso/camchain.yaml", "%YAML:1.0\n" + chain);
  const Calibration calibration = ReadKalibrCalibration(path, "", &warnings);
  ExpectPoses(calibration);
  EXPECT_EQ(calibration.without_noise, path);
}

// What reading a sequence's calibration throws with a part of one of its files replaced.
InputFault FaultOf(const std::string& file, const std::string& part, const std::string& by) {
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 1});
  std::string text = testing::ReadText(folder.Path("mav0/" + file));
  const size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  folder.Write("mav0/" + file, text.replace(at, part.size(), by));
  Warnings warnings;
  return testing::Caught<InputFault>([&] { ReadAslCalibration(folder.Path("mav0"), &warnings); });
}

// As Kalibr writes lenses, with indices that are not all there.
TEST(KalibrCalibration, ChainsOfLensesOfAnyIndex) {
  const TempFolder folder;
  const std::string size = "  resolution: [640, 480]\n";
  const std::string pose =
      "  - [1, 0, 0, {}]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n";
  const auto by = [&](const char* key, double x_m) {
    return fmt::format("  {}:\n", key) + fmt::format(fmt::runtime(pose), x_m);
  };
  const std::string text =
      "cam0:\n  camera_model: ds\n  intrinsics: [-0.2, 0.6, 160, 160, 320, 240]\n"
      "  distortion_model: none\n  distortion_coeffs: []\n" +
      size + by("T_cam_imu", 0) +
      "cam2:\n  camera_model: eucm\n  intrinsics: [0.6, 1.1, 200, 200, 320, 240]\n"
      "  distortion_model: none\n  distortion_coeffs: []\n" +
      size + by("T_cam_imu", -0.1) +
      "cam3:\n  camera_model: omni\n  intrinsics: [1.2, 450, 450, 320, 240]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.01, 0, 0]\n" +
      size + by("T_cn_cnm1", -0.1);
  folder.Write("camchain.yaml", text);
  Warnings warnings;
  const auto read = [&](const std::vector<int>& cameras) {
    return ReadKalibrCalibration(folder.Path("camchain.yaml"), "", &warnings, Mirrored::kRefused,
                                 cameras);
  };
  EXPECT_THAT(read({}).cameras, ElementsAre(0, 2, 3));
  const Rig rig = read({2, 3}).rig;
  EXPECT_EQ(rig.cameras[0].distortion, Distortion::kExtendedUnified);
  EXPECT_EQ(rig.cameras[1].distortion, Distortion::kOmni);
  EXPECT_NEAR(rig.T_imu_camera[1].translation.x(), 0.2, 1e-12);
  EXPECT_THAT(MessageOf<DataError>([&] { read({1}); }), HasSubstr("cam0 cam2 cam3"));
  // Coefficients without a model are not read over.
  std::string without = text;
  const std::string model = "  distortion_model: radtan\n";
  folder.Write("camchain.yaml", without.erase(without.find(model), model.size()));
  EXPECT_THAT(MessageOf<DataError>([&] { read({}); }),
              HasSubstr("cam3: distortion_coeffs: found 4 numbers, expected none, or zeros"));
}

TEST(AslCalibrationFaults, HaveRemediesWithFileAndKey) {
  const std::string camera = "cam0/sensor.yaml", imu = "imu0/sensor.yaml";
  const struct {
    std::string file, part, by, found, remedy;
  } kFaults[] = {
      {camera, "[96, 64]", "[96.5, 64]", "found 96.5", "resolution in "},
      {camera, "[96, 64]", "[-96, 64]", "found resolution -96", "resolution (width, height) in "},
      {camera, "[96, 64]", "[1e300, 64]", "found 1e+300", "resolution in "},
      {camera, "[96, 64]", "96", "expected a list", "resolution"},
      {camera, "intrinsics: [60, ", "intrinsics: [", "found 3 numbers, expected fx, fy, cx, cy",
       "write fx, fy, cx, cy as intrinsics in "},
      {camera, "intrinsics: [60, ", "intrinsics: [6000, ", "focal length", "intrinsics (fx, fy"},
      {camera, "intrinsics: ", "intrinsic: ", "intrinsics: missing", "add intrinsics in "},
      {camera, "radial-tangential", "fow",
       "distortion_model: found 'fow', expected one of radial-tangential", "distortion_model in "},
      {camera, "radial-tangential", "fov", "found 4 numbers, expected 1 (w",
       "distortion_coefficients in "},
      {camera, "pinhole", "scaramuzza", "found 'scaramuzza', expected one of pinhole",
       "camera_model in "},
      {camera, "pinhole", "omni", "found 4 numbers, expected xi, fx, fy, cx, cy", "intrinsics in "},
      {camera, "pinhole", "ds", "found 4 numbers, expected xi, alpha, fx, fy, cx, cy",
       "intrinsics in "},
      {camera, "radial-tangential", "none", "expected none, or zeros",
       "distortion_coefficients in "},
      {camera, "[-0.1, 0.01, 0.0, 0.0]", "[-0.1, 0.01]", "found 2 numbers",
       "distortion_coefficients in "},
      {camera, "rate_hz: 20\n", "rate_hz: 20\ntimeshift_cam_imu: -10\n",
       "timeshift_cam_imu: found -10 s, expected at most 1 s either way", "one clock"},
      {camera, "rate_hz: 20\n", "rate_hz: 20\nreadout_s: 20\n",
       "readout_s: found 20 s, expected at most 0.1 s either way", "readout_s in "},
      {"cam1/sensor.yaml", "rate_hz: 20\n", "rate_hz: 20\ntimeshift_cam_imu: 0.2\n",
       "timeshift_cam_imu: found 0.2 s, expected that of cam0, 0 s", "timeshift_cam_imu in "},
      {camera, "0, 0, 0, 1]", "0, 0, 5, 1]", "found the last row '0 0 5 1'", "T_BS in "},
      {camera, "[0, 0, 1, 0,", "[0, 0, 2, 0,", "is not a rotation", "copy T_BS in "},
      {camera, "rows: 4", "rows: 3", "rows: found 3", "T_BS.rows in "},
      {"cam1/sensor.yaml", "T_BS", "T_SB", "missing", "add T_BS.data in "},
      {"cam1/sensor.yaml", "-1, 0, 0, -0.1", "-1, 0, 0, -100", "found a baseline of 100 m",
       "metres, not millimetres"},
      {"cam1/sensor.yaml", "-1, 0, 0, -0.1", "-1, 0, 0, 0", "found a baseline of 0 m",
       "not the same twice; or name two that are apart with --cameras"},
      {imu, "1.7e-4", "low", "found 'low'", "correct "},
      {imu, "1.7e-4", "0", "found 0, expected 1e-07 to 1 rad/s/sqrt(Hz)",
       "gyroscope_noise_density in "},
      {imu, "accelerometer_random_walk: 3e-3", "accelerometer_random_walk: 1e-12", "m/s^3/sqrt(Hz)",
       "accelerometer_random_walk in "},
      {imu, "1.7e-4", "17", "gyroscope_noise_density: found 17", "gyroscope_noise_density in "},
      {imu, "rate_hz: 200", "rate_hz: 0", "rate_hz: found 0", "rate_hz in "}};
  for (const auto& fault : kFaults) {
    const InputFault found = FaultOf(fault.file, fault.part, fault.by);
    EXPECT_THAT(found.what(), AllOf(HasSubstr(fault.found), HasSubstr("mav0"))) << fault.by;
    EXPECT_THAT(found.remedy(), AllOf(HasSubstr(fault.remedy), HasSubstr("mav0"))) << fault.by;
  }
}

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
