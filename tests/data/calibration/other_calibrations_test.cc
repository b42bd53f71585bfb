#include "data/calibration/other_calibrations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "tests/testing/caught.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

// The rig that all files of this test tell.
Rig TwinRig(const char* lens) {
  Rig rig;
  for (size_t i = 0; i < 2; ++i) {
    Camera& camera = rig.cameras[i];
    camera.width_px = 640;
    camera.height_px = 480;
    const double more = 2.0 * static_cast<double>(i);
    camera.fx_px = 400 + more;
    camera.fy_px = 401 + more;
    camera.cx_px = 320.5 + more;
    camera.cy_px = 238.25 + more;
    camera.distortion = *FindDistortion(lens);
    camera.coefficients << -0.02, 0.01, 0.001, -0.0015;
  }
  if (lens == std::string("omni")) rig.cameras[0].shape[0] = rig.cameras[1].shape[0] = 0.75;
  if (lens == std::string("ds")) {
    for (Camera& camera : rig.cameras) {
      camera.coefficients.setZero();
      camera.shape = {-0.17, 0.59};
    }
  }
  rig.T_imu_camera[0] = {ExpRotation({0.02, -1.5, 0.3}), {0.03, -0.05, 0.01}};
  rig.T_imu_camera[1] = rig.T_imu_camera[0] *
                        RigidTransform{ExpRotation({0.01, 0.005, -0.02}), {0.11, 0.001, -0.002}};
  rig.imu_noise = {1.2e-4, 1.3e-5, 1.4e-3, 1.5e-4, 250};
  rig.camera_time_offset_s = 0.0125;
  return rig;
}

std::string Numbers(const Eigen::MatrixXd& matrix) {
  std::vector<double> rows;
  for (int r = 0; r < matrix.rows(); ++r) {
    for (int c = 0; c < matrix.cols(); ++c) rows.push_back(matrix(r, c));
  }
  return fmt::format("{}", fmt::join(rows, ", "));
}

std::string OpenCvMatrix(const std::string& key, const Eigen::MatrixXd& matrix) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [{}]\n",
                     key, matrix.rows(), matrix.cols(), Numbers(matrix));
}

Eigen::Matrix3d Intrinsics(const Camera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1;
  return k;
}

RigidTransform LeftRight(const Rig& rig) {
  return rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
}

std::string WriteOrbSlam(const TempFolder& folder, const Rig& rig) {
  const bool is_fisheye = rig.cameras[0].distortion == Distortion::kEquidistant;
  std::string text = fmt::format("%YAML:1.0\n---\nFile.version: \"1.0\"\nCamera.type: \"{}\"\n",
                                 is_fisheye ? "KannalaBrandt8" : "PinHole");
  const std::vector<const char*> names = is_fisheye
                                             ? std::vector<const char*>{"k1", "k2", "k3", "k4"}
                                             : std::vector<const char*>{"k1", "k2", "p1", "p2"};
  for (size_t i = 0; i < 2; ++i) {
    const Camera& camera = rig.cameras[i];
    const std::string key = fmt::format("Camera{}.", i + 1);
    text += fmt::format("{0}fx: {1}\n{0}fy: {2}\n{0}cx: {3}\n{0}cy: {4}\n", key, camera.fx_px,
                        camera.fy_px, camera.cx_px, camera.cy_px);
    for (int k = 0; k < 4; ++k) {
      text += fmt::format("{}{}: {}\n", key, names[static_cast<size_t>(k)], camera.coefficients[k]);
    }
  }
  return folder.Write("orb.yaml",
                      text + "Camera.width: 640\nCamera.height: 480\n" +
                          OpenCvMatrix("Stereo.T_c1_c2", LeftRight(rig).Matrix()) +
                          OpenCvMatrix("IMU.T_b_c1", rig.T_imu_camera[0].Matrix()) +
                          "IMU.NoiseGyro: 1.2e-4\nIMU.NoiseAcc: 1.4e-3\nIMU.GyroWalk: 1.3e-05\n"
                          "IMU.AccWalk: 1.5e-04\nIMU.Frequency: 250.0\nViewer.PointSize: 2.0\n");
}

std::string VinsCamera(const Camera& camera) {
  const Eigen::Vector4d& k = camera.coefficients;
  const std::string head =
      "%YAML:1.0\n---\ncamera_name: camera\nimage_width: 640\n"
      "image_height: 480\n";
  if (camera.distortion == Distortion::kEquidistant) {
    return head + fmt::format(
                      "model_type: KANNALA_BRANDT\nprojection_parameters:\n   k2: {}\n"
                      "   k3: {}\n   k4: {}\n   k5: {}\n   mu: {}\n   mv: {}\n   u0: {}\n"
                      "   v0: {}\n",
                      k[0], k[1], k[2], k[3], camera.fx_px, camera.fy_px, camera.cx_px,
                      camera.cy_px);
  }
  const std::string distortion =
      fmt::format("distortion_parameters:\n   k1: {}\n   k2: {}\n   p1: {}\n   p2: {}\n", k[0],
                  k[1], k[2], k[3]);
  const std::string f = fmt::format("{}", camera.fx_px), g = fmt::format("{}", camera.fy_px);
  const std::string u = fmt::format("{}", camera.cx_px), v = fmt::format("{}", camera.cy_px);
  if (camera.distortion == Distortion::kOmni) {
    return head + distortion +
           "model_type: MEI\nmirror_parameters:\n   xi: 0.75\nprojection_parameters:\n   gamma1: " +
           f + "\n   gamma2: " + g + "\n   u0: " + u + "\n   v0: " + v + "\n";
  }
  return head + distortion + "model_type: PINHOLE\nprojection_parameters:\n   fx: " + f +
         "\n   fy: " + g + "\n   cx: " + u + "\n   cy: " + v + "\n";
}

std::string WriteVins(const TempFolder& folder, const Rig& rig) {
  folder.Write("cam0.yaml", VinsCamera(rig.cameras[0]));
  folder.Write("cam1.yaml", VinsCamera(rig.cameras[1]));
  return folder.Write("vins.yaml",
                      "%YAML:1.0\n\nimu: 1\nnum_of_cam: 2\ncam0_calib: \"cam0.yaml\"\n"
                      "cam1_calib: \"cam1.yaml\"\nimage_width: 640\nimage_height: 480\n" +
                          OpenCvMatrix("body_T_cam0", rig.T_imu_camera[0].Matrix()) +
                          OpenCvMatrix("body_T_cam1", rig.T_imu_camera[1].Matrix()) +
                          "acc_n: 0.1\ngyr_n: 0.01\nacc_w: 0.001\ngyr_w: 0.0001\ntd: 0.0125\n");
}

std::string WriteBasalt(const TempFolder& folder, const Rig& rig) {
  const bool is_fisheye = rig.cameras[0].distortion == Distortion::kEquidistant;
  std::string poses, cameras;
  for (size_t i = 0; i < 2; ++i) {
    const RigidTransform& pose = rig.T_imu_camera[i];
    const Camera& camera = rig.cameras[i];
    const Eigen::Quaterniond& q = pose.rotation;
    const Eigen::Vector3d& t = pose.translation;
    const std::string comma = i == 0 ? "," : "";
    poses +=
        fmt::format(R"({{"px": {}, "py": {}, "pz": {}, "qx": {}, "qy": {}, "qz": {}, "qw": {}}}{})",
                    t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), comma);
    const Eigen::Vector4d& k = camera.coefficients;
    cameras += fmt::format(
        R"({{"camera_type": "{}", "intrinsics": {{"fx": {}, "fy": {}, "cx": {}, "cy": {}, {}}}}}{})",
        is_fisheye ? "kb4" : "ds", camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px,
        is_fisheye
            ? fmt::format(R"("k1": {}, "k2": {}, "k3": {}, "k4": {})", k[0], k[1], k[2], k[3])
            : fmt::format(R"("xi": {}, "alpha": {})", camera.shape[0], camera.shape[1]),
        comma);
  }
  return folder.Write("basalt.json", R"({"value0": {"T_imu_cam": [)" + poses +
                                         R"(], "intrinsics": [)" + cameras +
                                         R"(], "resolution": [[640, 480], [640, 480]],
 "calib_accel_bias": [0.1, 0, 0, 0.01, 0.002, 0.003, 0, 0, 0],
 "calib_gyro_bias": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
 "imu_update_rate": 250.0, "accel_noise_std": [1.4e-3, 1.4e-3, 1.4e-3],
 "gyro_noise_std": [1.2e-4, 1.2e-4, 1.2e-4], "accel_bias_std": [1.5e-4, 1.5e-4, 1.5e-4],
 "gyro_bias_std": [1.3e-5, 1.3e-5, 1.3e-5], "cam_time_offset_ns": 12500000}})");
}

const char* kPoseAndNoise =
    "imu0:\n  gyroscope_noise_density: 1.2e-4\n  gyroscope_random_walk: 1.3e-5\n"
    "  accelerometer_noise_density: 1.4e-3\n  accelerometer_random_walk: 1.5e-4\n"
    "  update_rate: 250\n";

// The left camera's pose, time shift and the IMU's noise, as a Kalibr chain has them.
std::string WritePart(const TempFolder& folder, const Rig& rig) {
  const Eigen::Matrix4d m = rig.T_imu_camera[0].Matrix();
  std::string rows;
  for (int r = 0; r < 4; ++r) rows += fmt::format("  - [{}]\n", Numbers(m.row(r)));
  return folder.Write("pose.yaml",
                      "cam0:\n  timeshift_cam_imu: 0.0125\n  T_imu_cam:\n" + rows + kPoseAndNoise);
}

Eigen::MatrixXd FromCv(const cv::Mat& matrix) {
  Eigen::MatrixXd read;
  cv::cv2eigen(matrix, read);
  return read;
}

// As camera_calibration writes them, rectified by OpenCV.
std::string WriteRos(const TempFolder& folder, const Rig& rig) {
  const RigidTransform T_right_left = LeftRight(rig).Inverse();
  std::array<cv::Mat, 2> k, d, r, p;
  for (size_t i = 0; i < 2; ++i) {
    cv::eigen2cv(Eigen::Matrix3d(Intrinsics(rig.cameras[i])), k[i]);
    cv::eigen2cv(Eigen::Vector4d(rig.cameras[i].coefficients), d[i]);
  }
  cv::Mat turn, shift, q;
  cv::eigen2cv(Eigen::Matrix3d(T_right_left.rotation.toRotationMatrix()), turn);
  cv::eigen2cv(Eigen::Vector3d(T_right_left.translation), shift);
  cv::stereoRectify(k[0], d[0], k[1], d[1], {640, 480}, turn, shift, r[0], r[1], p[0], p[1], q);
  std::string paths;
  const auto matrix = [](const char* key, const Eigen::MatrixXd& m) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", key, m.rows(), m.cols(),
                       Numbers(m));
  };
  for (size_t i = 0; i < 2; ++i) {
    const std::string path = folder.Write(
        i == 0 ? "left.yaml" : "right.yaml",
        "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo\n"
        "distortion_model: plumb_bob\n" +
            matrix("camera_matrix", FromCv(k[i])) +
            fmt::format("distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, 0]\n",
                        Numbers(rig.cameras[i].coefficients)) +
            matrix("rectification_matrix", FromCv(r[i])) +
            matrix("projection_matrix", FromCv(p[i])));
    paths += path + ",";
  }
  return paths + WritePart(folder, rig);
}

std::string WriteOpenCv(const TempFolder& folder, const Rig& rig) {
  const RigidTransform T_right_left = LeftRight(rig).Inverse();
  const std::string cameras = folder.Write(
      "intrinsics.yml", "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n" +
                            OpenCvMatrix("M1", Intrinsics(rig.cameras[0])) +
                            OpenCvMatrix("D1", rig.cameras[0].coefficients.transpose()) +
                            OpenCvMatrix("M2", Intrinsics(rig.cameras[1])) +
                            OpenCvMatrix("D2", rig.cameras[1].coefficients.transpose()));
  const std::string poses = folder.Write(
      "extrinsics.yml", "%YAML:1.0\n---\n" +
                            OpenCvMatrix("R", T_right_left.rotation.toRotationMatrix()) +
                            OpenCvMatrix("T", T_right_left.translation) +
                            OpenCvMatrix("Q", Eigen::Matrix4d::Identity()));
  return cameras + "," + poses + "," + WritePart(folder, rig);
}

void ExpectTwin(const Calibration& read, const Rig& rig) {
  for (size_t i = 0; i < 2; ++i) {
    const Camera &camera = read.rig.cameras[i], &twin = rig.cameras[i];
    EXPECT_EQ(camera.distortion, twin.distortion);
    EXPECT_EQ(camera.width_px, twin.width_px);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, 0.2, 1), Eigen::Vector3d(-0.4, 0.1, 1)}) {
      ASSERT_TRUE(camera.Project(p) && twin.Project(p));
      EXPECT_LT((*camera.Project(p) - *twin.Project(p)).norm(), 1e-6);
    }
    EXPECT_LT((read.rig.T_imu_camera[i].Matrix() - rig.T_imu_camera[i].Matrix()).norm(), 1e-6) << i;
  }
}

struct TwinCase {
  const char* name;
  const char* lens;
  std::string (*write)(const TempFolder& folder, const Rig& rig);
  bool has_offset, has_noise;
};

class OtherForm : public ::testing::TestWithParam<TwinCase> {};

TEST_P(OtherForm, IsReadAsItsKalibrTwin) {
  const TempFolder folder;
  const Rig made = TwinRig(GetParam().lens);
  WriteKalibrCalibration(folder.Path("kalibr.yaml"), made);
  Warnings warnings;
  const Rig twin = ReadCalibration(folder.Path("kalibr.yaml"), &warnings).rig;
  const Calibration read = ReadCalibration(GetParam().write(folder, made), &warnings);
  ExpectTwin(read, twin);
  EXPECT_NEAR(read.rig.camera_time_offset_s, GetParam().has_offset ? 0.0125 : 0, 1e-12);
  EXPECT_EQ(read.without_noise.empty(), GetParam().has_noise);
  if (GetParam().has_noise) {
    EXPECT_DOUBLE_EQ(read.rig.imu_noise.gyro_walk_rad_s2_sqrthz, 1.3e-5);
    EXPECT_DOUBLE_EQ(read.rig.imu_noise.accel_noise_m_s2_sqrthz, 1.4e-3);
    EXPECT_EQ(read.rig.imu_noise.rate_hz, 250);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, OtherForm,
    ::testing::Values(TwinCase{"OrbSlamPinhole", "radtan", WriteOrbSlam, false, true},
                      TwinCase{"OrbSlamFisheye", "equidistant", WriteOrbSlam, false, true},
                      TwinCase{"VinsPinhole", "radtan", WriteVins, true, false},
                      TwinCase{"VinsMei", "omni", WriteVins, true, false},
                      TwinCase{"VinsFisheye", "equidistant", WriteVins, true, false},
                      TwinCase{"BasaltDoubleSphere", "ds", WriteBasalt, true, true},
                      TwinCase{"BasaltFisheye", "equidistant", WriteBasalt, true, true},
                      TwinCase{"Ros", "radtan", WriteRos, true, true},
                      TwinCase{"OpenCv", "radtan", WriteOpenCv, true, true}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(OtherForms, TwoFilesThatTellTheSameAreBothNamed) {
  const TempFolder folder;
  Warnings warnings;
  const Rig rig = TwinRig("radtan");
  const std::string orb = WriteOrbSlam(folder, rig), pose = WritePart(folder, rig);
  const std::string ros = WriteRos(folder, rig);
  const auto refusal = [&](const std::string& paths) {
    return MessageOf<InputFault>([&] { ReadCalibration(paths, &warnings); });
  };
  EXPECT_THAT(refusal(orb + "," + pose), AllOf(HasSubstr("pose.yaml: found the left camera's pose"),
                                               HasSubstr("orb.yaml tells as well")));
  EXPECT_THAT(refusal(orb + "," + folder.Path("right.yaml")),
              AllOf(HasSubstr("right.yaml: found the left camera, which"), HasSubstr("orb.yaml")));
  EXPECT_THAT(refusal(folder.Path("right.yaml") + "," + ros), HasSubstr("a third camera"));
}

TEST(OtherForms, AnInvertedTransformOfOrbSlamIsTold) {
  const TempFolder folder;
  Warnings warnings;
  Rig rig = TwinRig("radtan");
  ReadCalibration(WriteOrbSlam(folder, rig), &warnings);
  EXPECT_EQ(warnings.Count(kRightAtLeft), 0);
  rig.T_imu_camera[1] = rig.T_imu_camera[0] * LeftRight(rig).Inverse();
  ReadCalibration(WriteOrbSlam(folder, rig), &warnings);
  EXPECT_EQ(warnings.Count(kRightAtLeft), 1);
}

TEST(OtherForms, BasaltsScaleIsTheImusCorrection) {
  const TempFolder folder;
  Warnings warnings;
  const Rig rig = ReadCalibration(WriteBasalt(folder, TwinRig("ds")), &warnings).rig;
  EXPECT_NEAR(rig.imu_correction.accel(0, 0), 1.01, 1e-12);
  EXPECT_NEAR(rig.imu_correction.accel(1, 0), 0.002, 1e-12);
  EXPECT_NEAR(rig.imu_correction.accel(2, 0), 0.003, 1e-12);
  EXPECT_TRUE(rig.imu_correction.gyro.isIdentity(0));
}

TEST(OtherForms, RectifiedSettingsOfOrbSlamAreTwoAlikeCameras) {
  const TempFolder folder;
  const std::string path = folder.Write(
      "orb.yaml",
      "Camera.type: Rectified\nCamera1.fx: 400\nCamera1.fy: 400\nCamera1.cx: 320\nCamera1.cy: 240\n"
      "Camera.width: 640\nCamera.height: 480\nStereo.b: 0.05\n" +
          OpenCvMatrix("IMU.T_b_c1", Eigen::Matrix4d::Identity()));
  Warnings warnings;
  const Rig rig = ReadCalibration(path, &warnings).rig;
  EXPECT_EQ(rig.cameras[1].distortion, Distortion::kNone);
  EXPECT_EQ(rig.cameras[1].fx_px, 400);
  EXPECT_NEAR(rig.T_imu_camera[1].translation.x(), 0.05, 1e-12);
}

// The fault of files, with its remedy.
std::string FaultOfFiles(const std::string& paths) {
  Warnings warnings;
  const auto fault = testing::Caught<InputFault>([&] { ReadCalibration(paths, &warnings); });
  return fault.what() + ("; " + fault.remedy());
}

TEST(OtherForms, FilesThatAnotherOneNamesMayBeNamedToo) {
  const TempFolder folder;
  const std::string vins = WriteVins(folder, TwinRig("radtan"));
  const std::string cameras = folder.Path("cam0.yaml") + "," + folder.Path("cam1.yaml");
  Warnings warnings;
  const Rig alone = ReadCalibration(vins, &warnings).rig;
  const std::string swapped = folder.Path("cam1.yaml") + "," + folder.Path("cam0.yaml");
  for (const std::string& paths : {vins + "," + cameras, cameras + "," + vins, swapped + "," + vins,
                                   folder.Path("cam1.yaml") + "," + vins}) {
    const Rig rig = ReadCalibration(paths, &warnings).rig;
    for (const size_t i : {0, 1}) {
      EXPECT_TRUE(rig.cameras[i].coefficients == alone.cameras[i].coefficients) << paths;
      EXPECT_EQ(rig.cameras[i].fx_px, alone.cameras[i].fx_px) << paths;
    }
    EXPECT_TRUE(rig.T_imu_camera[1].translation == alone.T_imu_camera[1].translation);
  }
}

TEST(OtherForms, ThatTellNoWholeRigAreNamed) {
  const TempFolder folder;
  EXPECT_THAT(
      FaultOfFiles(folder.Write("orb2.yaml", "%YAML:1.0\nCamera.fx: 435\nCamera.bf: 47.9\n")),
      AllOf(HasSubstr("ORB-SLAM2"), HasSubstr("Camera1.fx")));
  Rig squares = TwinRig("radtan");
  for (RigidTransform& pose : squares.T_imu_camera) pose.translation /= 0.03;
  EXPECT_THAT(FaultOfFiles(WriteVins(folder, squares)), HasSubstr("squares of a chessboard"));
}

TEST(OtherForms, WhatIsMissingIsOneFaultWithATemplate) {
  const TempFolder folder;
  const std::string all = WriteRos(folder, TwinRig("radtan"));
  const std::string pair = all.substr(0, all.rfind(','));
  const std::string left = pair.substr(0, pair.find(','));
  EXPECT_THAT(FaultOfFiles(pair),
              AllOf(HasSubstr("missing is the left camera's pose to the IMU"),
                    HasSubstr("cam0: {T_imu_cam: [["), HasSubstr("--calibration")));
  const std::string pose = WritePart(folder, TwinRig("radtan"));
  Warnings warnings;
  EXPECT_FALSE(IsStereo(ReadCalibration(left + "," + pose, &warnings).rig));
  const std::string both =
      folder.Write("both.yaml", testing::ReadText(pose) +
                                    "cam1:\n  T_imu_cam: [[1, 0, 0, 0.1], "
                                    "[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  EXPECT_THAT(FaultOfFiles(left + "," + both),
              AllOf(HasSubstr("missing is the right camera's intrinsics"),
                    HasSubstr("cam1: {camera_model: pinhole")));
  const std::string right = pair.substr(pair.find(',') + 1);
  EXPECT_THAT(FaultOfFiles(right + "," + left), HasSubstr("name the left camera's file first"));
  EXPECT_THAT(FaultOfFiles(pair + "," + left), HasSubstr("found a third camera"));
}

TEST(OtherForms, WrongOnesAreRefusedByName) {
  const TempFolder folder;
  const auto fault = [&](std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return FaultOfFiles(folder.Write("wrong.yaml", text.replace(at, from.size(), to)));
  };
  const Rig rig = TwinRig("radtan");
  const std::string orb = testing::ReadText(WriteOrbSlam(folder, rig));
  EXPECT_THAT(
      fault(orb, "PinHole", "Panorama"),
      AllOf(HasSubstr("wrong.yaml: Camera.type: found 'Panorama'"), HasSubstr("expected PinHole")));
  EXPECT_THAT(fault(orb, "Camera2.cy", "Camera2.c"), HasSubstr("Camera2.cy: missing"));
  EXPECT_THAT(fault(orb, "rows: 4", "rows: 3"), HasSubstr("rows: found 3, expected 4"));
  WriteVins(folder, rig);
  const std::string vins = testing::ReadText(folder.Path("vins.yaml"));
  EXPECT_THAT(fault(vins, "cam1.yaml", "cam7.yaml"), HasSubstr("cam7.yaml"));
  const std::string camera = testing::ReadText(folder.Path("cam0.yaml"));
  EXPECT_THAT(fault(camera, "PINHOLE", "SCARAMUZZA"), HasSubstr("found 'SCARAMUZZA'"));
  const std::string basalt = testing::ReadText(WriteBasalt(folder, TwinRig("ds")));
  EXPECT_THAT(fault(basalt, "\"ds\"", "\"mirror\""), HasSubstr("camera_model: found 'mirror'"));
  EXPECT_THAT(fault(basalt, ", [640, 480]]", "]"), HasSubstr("1 resolutions"));
  EXPECT_THAT(fault(basalt, "[[640, 480]", "[[1e300, 480]"), HasSubstr("whole numbers"));
}

}  // namespace
}  // namespace slcmap
