// Settings of ORB-SLAM3 and VINS, and Basalt's calibrations.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/calibration/calibration_forms.h"
#include "data/calibration/calibration_keys.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"

namespace slcmap::inline data {
namespace {
void ReadOptional(YamlSection* section, const std::string& key, std::vector<double>* values) {
  if (!section->Has(key)) return;
  values->push_back(0);
  section->Read(key, &values->back());
}

// ORB-SLAM3

CameraWords ReadOrbSlamCamera(YamlSection* root, const std::string& type, int number) {
  const auto key = [&](const char* name) { return fmt::format("Camera{}.{}", number, name); };
  CameraWords words{"pinhole", "none", {}, {}};
  words.intrinsics = ReadNumbers(root, {key("fx"), key("fy"), key("cx"), key("cy")});
  if (type == "KannalaBrandt8") {
    words.distortion_model = "equidistant";
    words.coefficients = ReadNumbers(root, {key("k1"), key("k2"), key("k3"), key("k4")});
  } else if (type == "PinHole" && root->Has(key("k1"))) {
    words.distortion_model = "radtan";
    words.coefficients = ReadNumbers(root, {key("k1"), key("k2"), key("p1"), key("p2")});
    ReadOptional(root, key("k3"), &words.coefficients);
  } else if (type != "PinHole" && type != "Rectified") {
    throw CalibrationFault(*root, "Camera.type",
                           "found '" + type + "', expected PinHole, KannalaBrandt8 or Rectified",
                           "correct Camera.type in " + root->place());
  }
  return words;
}

}  // namespace

void ReadOrbSlam(YamlSection* root, Gathered* gathered) {
  RigParts& parts = gathered->parts;
  const std::string place = root->place();
  const auto type = RequiredValue<std::string>(*root, "Camera.type");
  const cv::Size size = ReadSize(root, "Camera.width", "Camera.height");
  const bool is_rectified = type == "Rectified";
  parts.has_right = is_rectified || root->Has("Camera2.fx");
  for (int i = 0; i < (parts.has_right ? 2 : 1); ++i) {
    const CameraWords words = ReadOrbSlamCamera(root, type, is_rectified ? 1 : i + 1);
    parts.cameras[static_cast<size_t>(i)] =
        RequiredCamera(words, size, fmt::format("{}: Camera{}", place, i + 1));
  }
  if (is_rectified) {
    const double baseline_m = RequiredValue<double>(*root, "Stereo.b");
    parts.T_left_right = {Eigen::Quaterniond::Identity(), {baseline_m, 0, 0}};
  } else if (parts.has_right) {
    parts.T_left_right = RequiredTransform(*root, "Stereo.T_c1_c2", true, gathered->mirrored);
    // ORB-SLAM3 itself wants the left camera first.
    const Eigen::Vector3d& at = parts.T_left_right->translation;
    if (at.x() < -0.5 * at.norm()) {
      gathered->warnings->Add(kRightAtLeft,
                              place + ": Stereo.T_c1_c2 is inverted, or its cameras are swapped");
    }
  }
  if (root->Has("IMU.T_b_c1")) {
    parts.T_imu_camera[0] = RequiredTransform(*root, "IMU.T_b_c1", true, gathered->mirrored);
  }
  if (root->Has("IMU.NoiseGyro")) {
    parts.imu_noise.emplace();
    ReadNoise(*root,
              {"IMU.NoiseGyro", "IMU.GyroWalk", "IMU.NoiseAcc", "IMU.AccWalk", "IMU.Frequency"},
              &*parts.imu_noise);
  }
  parts.found.push_back("settings of ORB-SLAM3 in " + place);
}

namespace {

// VINS

struct VinsModel {
  const char* name;
  CameraWords words;                    // the names
  std::vector<std::string> projection;  // keys of the intrinsics
  std::vector<std::string> distortion;  // of the coefficients
};

const std::vector<VinsModel>& VinsModels() {
  static const std::vector<VinsModel> models = {{"PINHOLE",
                                                 {"pinhole", "radtan", {}, {}},
                                                 {"fx", "fy", "cx", "cy"},
                                                 {"k1", "k2", "p1", "p2"}},
                                                {"MEI",
                                                 {"omni", "radtan", {}, {}},
                                                 {"gamma1", "gamma2", "u0", "v0"},
                                                 {"k1", "k2", "p1", "p2"}},
                                                // camodocal counts from the linear term.
                                                {"KANNALA_BRANDT",
                                                 {"pinhole", "equidistant", {}, {}},
                                                 {"mu", "mv", "u0", "v0"},
                                                 {"k2", "k3", "k4", "k5"}}};
  return models;
}

Camera ReadVinsCamera(YamlSection* root) {
  const auto name = RequiredValue<std::string>(*root, "model_type");
  const auto& models = VinsModels();
  const auto model =
      std::ranges::find_if(models, [&](const VinsModel& known) { return name == known.name; });
  if (model == models.end()) {
    throw CalibrationFault(*root, "model_type",
                           "found '" + name + "', expected PINHOLE, MEI or KANNALA_BRANDT",
                           "calibrate with one of these models");
  }
  YamlSection projection = root->Section("projection_parameters");
  YamlSection distortion = root->Section("distortion_parameters");
  const bool is_apart = distortion.Has(model->distortion.front());
  CameraWords words = model->words;
  words.intrinsics = ReadNumbers(&projection, model->projection);
  words.coefficients = ReadNumbers(is_apart ? &distortion : &projection, model->distortion);
  if (name == "MEI") {
    YamlSection mirror = root->Section("mirror_parameters");
    words.intrinsics.insert(words.intrinsics.begin(), RequiredValue<double>(mirror, "xi"));
  }
  return RequiredCamera(words, ReadSize(root, "image_width", "image_height"), root->place());
}

}  // namespace

void ReadVinsCameraFile(YamlSection* root, Gathered* gathered) {
  TakeCamera(ReadVinsCamera(root), root->place(), gathered);
}

namespace {

void ReadVinsPoses(YamlSection* root, Gathered* gathered) {
  RigParts& parts = gathered->parts;
  for (const int i : {0, 1}) {
    const std::string key = fmt::format("body_T_cam{}", i);
    if (!root->Has(key)) continue;
    parts.T_imu_camera[static_cast<size_t>(i)] =
        RequiredTransform(*root, key, true, gathered->mirrored);
  }
  if (root->Has("extrinsicRotation")) {
    parts.T_imu_camera[0] =
        FromRows(RequiredMatrix(*root, "extrinsicRotation", 3, 3),
                 RequiredMatrix(*root, "extrinsicTranslation", 3, 1), root->place());
  }
}

}  // namespace

void ReadVins(YamlSection* root, Gathered* gathered) {
  RigParts& parts = gathered->parts;
  const std::filesystem::path folder = std::filesystem::path(root->place()).parent_path();
  int cameras = root->Has("cam1_calib") ? 2 : 1;
  root->Read("num_of_cam", &cameras);
  parts.has_right = cameras > 1;
  for (int i = 0; i < std::min(cameras, 2); ++i) {
    if (root->Has("model_type")) {
      TakeCamera(ReadVinsCamera(root), root->place(), gathered);
      continue;
    }
    const auto name = RequiredValue<std::string>(*root, fmt::format("cam{}_calib", i));
    YamlSection camera = YamlSection::FromFile((folder / name).string());
    ReadVinsCameraFile(&camera, gathered);
  }
  ReadVinsPoses(root, gathered);
  if (root->Has("td")) parts.camera_time_offset_s = RequiredValue<double>(*root, "td");
  parts.found.push_back("settings of VINS in " + root->place());
}

namespace {

// Basalt

Camera ReadBasaltCamera(YamlSection* camera, const cv::Size& size_px) {
  struct Model {
    const char* name;
    std::vector<std::string> lens;  // keys behind fx, fy, cx, cy
  };
  static const std::vector<Model> kModels = {
      {"pinhole", {}},
      {"ds", {"xi", "alpha"}},
      {"eucm", {"alpha", "beta"}},
      {"ucm", {"alpha"}},
      {"fov", {"w"}},
      {"kb4", {"k1", "k2", "k3", "k4"}},
      {"pinhole-radtan8", {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}}};
  CameraWords words{RequiredValue<std::string>(*camera, "camera_type"), "none", {}, {}};
  const auto model = std::ranges::find_if(
      kModels, [&](const Model& known) { return words.camera_model == known.name; });
  YamlSection numbers = camera->Section("intrinsics");
  words.intrinsics = ReadNumbers(&numbers, {"fx", "fy", "cx", "cy"});
  if (model != kModels.end()) {
    const std::vector<double> lens = ReadNumbers(&numbers, model->lens);
    if (words.camera_model == "fov") {
      words = {"pinhole", "fov", words.intrinsics, lens};
    } else {
      words.intrinsics.insert(words.intrinsics.end(), lens.begin(), lens.end());
    }
  }
  return RequiredCamera(words, size_px, camera->place());
}

RigidTransform ReadBasaltPose(YamlSection* pose) {
  const std::vector<double> v = ReadNumbers(pose, {"px", "py", "pz", "qx", "qy", "qz", "qw"});
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (std::abs(rotation.norm() - 1) > 1e-3) {
    throw CalibrationFault(*pose, "qw", "found a quaternion that is not of unit length",
                           "copy qx, qy, qz, qw from the calibration anew");
  }
  return {rotation.normalized(), {v[0], v[1], v[2]}};
}

// The mean of three axes.
double ReadAxes(YamlSection* root, const std::string& key) {
  const std::vector<double> axes = RequiredNumbers(*root, key, 3);
  return (axes[0] + axes[1] + axes[2]) / 3;
}

// Basalt adds (I + scale) to a reading, column by column behind the bias; the accelerometer's is a
// lower triangle.
Eigen::Matrix3d ReadBasaltGain(YamlSection* root, const std::string& key, bool is_triangle) {
  const std::vector<double> v = RequiredNumbers(*root, key, is_triangle ? 9 : 12);
  Eigen::Matrix3d gain = Eigen::Matrix3d::Identity();
  size_t at = 3;
  for (int column = 0; column < 3; ++column) {
    for (int row = is_triangle ? column : 0; row < 3; ++row) gain(row, column) += v[at++];
  }
  return gain;
}

void ReadBasaltImu(YamlSection* root, RigParts* parts) {
  if (root->Has("calib_accel_bias") && root->Has("calib_gyro_bias")) {
    parts->imu_correction = {ReadBasaltGain(root, "calib_accel_bias", true),
                             ReadBasaltGain(root, "calib_gyro_bias", false)};
  }
  if (root->Has("accel_noise_std")) {
    ImuNoise& noise = parts->imu_noise.emplace();
    noise.accel_noise_m_s2_sqrthz = ReadAxes(root, "accel_noise_std");
    noise.gyro_noise_rad_s_sqrthz = ReadAxes(root, "gyro_noise_std");
    noise.accel_walk_m_s3_sqrthz = ReadAxes(root, "accel_bias_std");
    noise.gyro_walk_rad_s2_sqrthz = ReadAxes(root, "gyro_bias_std");
    root->Read("imu_update_rate", &noise.rate_hz);
  }
  if (root->Has("cam_time_offset_ns")) {
    parts->camera_time_offset_s = 1e-9 * RequiredValue<double>(*root, "cam_time_offset_ns");
  }
}

}  // namespace

void ReadBasalt(YamlSection* file, Gathered* gathered) {
  YamlSection root = file->Has("value0") ? file->Section("value0") : *file;
  std::vector<YamlSection> poses = root.List("T_imu_cam"), cameras = root.List("intrinsics");
  const auto sizes = RequiredValue<std::vector<std::vector<double>>>(root, "resolution");
  if (cameras.empty() || poses.size() != cameras.size() || sizes.size() != cameras.size() ||
      std::ranges::any_of(sizes, [](const auto& size) { return size.size() != 2; })) {
    throw CalibrationFault(root, "intrinsics",
                           fmt::format("found {} cameras, {} poses and {} resolutions, expected as "
                                       "many of each",
                                       cameras.size(), poses.size(), sizes.size()),
                           "write one of each a camera");
  }
  RigParts& parts = gathered->parts;
  parts.has_right = cameras.size() > 1;
  parts.Reserve(cameras.size());
  for (size_t i = 0; i < cameras.size(); ++i) {
    parts.cameras[i] = ReadBasaltCamera(&cameras[i], ResolutionFrom(sizes[i], root, "resolution"));
    parts.T_imu_camera[i] = ReadBasaltPose(&poses[i]);
  }
  ReadBasaltImu(&root, &parts);
  parts.found.push_back("Basalt's calibration in " + file->place());
}

}  // namespace slcmap::data
