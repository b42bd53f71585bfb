#include "data/calibration/other_calibrations.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_info.h"
#include "data/core/error.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {
namespace {

using Rows3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// What is gathered of several files.
struct Gathered {
  RigParts parts;
  std::vector<CameraInfo> infos;  // ROS': poses need both
  Mirrored mirrored = Mirrored::kRefused;
};

// The left camera, then the right one.
void TakeCamera(const Camera& camera, const std::string& place, RigParts* parts) {
  const size_t i = parts->cameras[0] ? 1 : 0;
  if (parts->cameras[i]) {
    throw InputFault("calibration", place + ": found a third camera, expected left and right",
                     "name the files of the two cameras of the pair");
  }
  parts->cameras[i] = camera;
  parts->found.push_back(fmt::format("{} camera of {}", i == 0 ? "left" : "right", place));
}

void ReadOptional(YamlSection* section, const std::string& key, std::vector<double>* values) {
  if (!section->Has(key)) return;
  values->push_back(0);
  section->Read(key, &values->back());
}

std::vector<double> ReadNumbers(YamlSection* section, const std::vector<std::string>& keys) {
  std::vector<double> values;
  for (const std::string& key : keys) values.push_back(RequiredValue<double>(*section, key));
  return values;
}

cv::Size ReadSize(YamlSection* section, const std::string& width, const std::string& height) {
  return {RequiredValue<int>(*section, width), RequiredValue<int>(*section, height)};
}

RigidTransform FromRows(const std::vector<double>& rotation, const std::vector<double>& translation,
                        const std::string& place) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = Eigen::Map<const Rows3>(rotation.data());
  matrix.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(translation.data());
  return RigidTransformFromMatrix(matrix, place);
}

// ROS

// The numbers of a matrix of any size.
std::vector<double> ReadData(YamlSection* root, const std::string& key) {
  YamlSection matrix = root->Section(key);
  return RequiredValue<std::vector<double>>(matrix, "data");
}

void ReadRos(YamlSection* root, Gathered* gathered) {
  CameraInfo info;
  info.place = root->place();
  const cv::Size size = ReadSize(root, "image_width", "image_height");
  info.width_px = size.width;
  info.height_px = size.height;
  info.distortion_model = RequiredValue<std::string>(*root, "distortion_model");
  info.d = ReadData(root, "distortion_coefficients");
  info.k = Eigen::Map<const Rows3>(RequiredMatrix(*root, "camera_matrix", 3, 3).data());
  info.r = Eigen::Map<const Rows3>(RequiredMatrix(*root, "rectification_matrix", 3, 3).data());
  info.p = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(
      RequiredMatrix(*root, "projection_matrix", 3, 4).data());
  TakeCamera(CameraFromInfo(info, ImageKind::kRaw), info.place, &gathered->parts);
  gathered->infos.push_back(info);
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

void ReadVinsCameraFile(YamlSection* root, Gathered* gathered) {
  TakeCamera(ReadVinsCamera(root), root->place(), &gathered->parts);
}

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

void ReadVins(YamlSection* root, Gathered* gathered) {
  RigParts& parts = gathered->parts;
  const std::filesystem::path folder = std::filesystem::path(root->place()).parent_path();
  int cameras = root->Has("cam1_calib") ? 2 : 1;
  root->Read("num_of_cam", &cameras);
  parts.has_right = cameras > 1;
  for (int i = 0; i < std::min(cameras, 2); ++i) {
    if (root->Has("model_type")) {
      TakeCamera(ReadVinsCamera(root), root->place(), &parts);
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
  for (size_t i = 0; i < std::min<size_t>(2, cameras.size()); ++i) {
    parts.cameras[i] = ReadBasaltCamera(&cameras[i], ResolutionFrom(sizes[i], root, "resolution"));
    parts.T_imu_camera[i] = ReadBasaltPose(&poses[i]);
  }
  ReadBasaltImu(&root, &parts);
  parts.found.push_back("Basalt's calibration in " + file->place());
}

// OpenCV

// The first of several names that is there.
std::string FirstKey(const YamlSection& root, const std::vector<std::string>& names) {
  const auto found = std::ranges::find_if(names, [&](const auto& name) { return root.Has(name); });
  return found == names.end() ? names.front() : *found;
}

std::vector<std::string> StereoNames(const char* of_number, const char* of_word, int camera) {
  return {fmt::format("{}{}", of_number, camera + 1), fmt::format("{}{}", of_word, camera + 1)};
}

cv::Size ReadOpenCvSize(YamlSection* root) {
  for (const char* key : {"image_size", "imageSize", "size"}) {
    if (root->Has(key)) return RequiredResolution(*root, key);
  }
  return ReadSize(root, FirstKey(*root, {"image_width", "imageWidth", "width"}),
                  FirstKey(*root, {"image_height", "imageHeight", "height"}));
}

void ReadOpenCvCameras(YamlSection* root, Gathered* gathered) {
  std::string model = "radtan";
  root->Read("distortion_model", &model);
  const cv::Size size = ReadOpenCvSize(root);
  for (const int i : {0, 1}) {
    std::vector<std::string> names = StereoNames("M", "cameraMatrix", i);
    names.push_back(fmt::format("K{}", i + 1));
    const std::vector<double> k = RequiredMatrix(*root, FirstKey(*root, names), 3, 3);
    const std::string d = FirstKey(*root, StereoNames("D", "distCoeffs", i));
    const CameraWords words{"pinhole", model, {k[0], k[4], k[2], k[5]}, ReadData(root, d)};
    TakeCamera(RequiredCamera(words, size, root->place()), root->place(), &gathered->parts);
  }
}

// stereoCalibrate's R and T take points of the left camera to the right one.
void ReadOpenCvPose(YamlSection* root, Gathered* gathered) {
  gathered->parts.T_left_right =
      FromRows(RequiredMatrix(*root, "R", 3, 3), RequiredMatrix(*root, "T", 3, 1), root->place())
          .Inverse();
  gathered->parts.found.push_back("R and T of " + root->place());
}

void ReadOpenCv(YamlSection* root, Gathered* gathered) {
  if (!root->Has("D1") && !root->Has("distCoeffs1")) return ReadOpenCvPose(root, gathered);
  ReadOpenCvCameras(root, gathered);
  if (root->Has("R") && root->Has("T")) ReadOpenCvPose(root, gathered);
}

// Parts of a Kalibr chain

void ReadKalibrPart(YamlSection* root, Gathered* gathered) {
  RigParts& parts = gathered->parts;
  for (const int i : {0, 1}) {
    YamlSection camera = root->Section(fmt::format("cam{}", i));
    std::optional<RigidTransform>& pose = parts.T_imu_camera[static_cast<size_t>(i)];
    if (camera.Has("T_imu_cam")) {
      pose = RequiredTransform(camera, "T_imu_cam", false, gathered->mirrored);
    } else if (camera.Has("T_cam_imu")) {
      pose = RequiredTransform(camera, "T_cam_imu", false, gathered->mirrored).Inverse();
    }
    if (camera.Has("T_cn_cnm1")) {
      parts.T_left_right =
          RequiredTransform(camera, "T_cn_cnm1", false, gathered->mirrored).Inverse();
    }
    if (i == 0 && camera.Has("timeshift_cam_imu")) {
      parts.camera_time_offset_s = RequiredValue<double>(camera, "timeshift_cam_imu");
    }
    for (const char* key : {"timeshift_cam_imu", "rostopic", "T_cam_imu"}) camera.Skip(key);
    camera.Finish();
  }
  YamlSection imu = root->Has("imu0") ? root->Section("imu0") : *root;
  if (imu.Has(NoiseKeys().gyro_noise)) {
    parts.imu_noise.emplace();
    ReadNoise(imu, {.rate = imu.Has("rate_hz") ? "rate_hz" : "update_rate"}, &*parts.imu_noise);
    parts.imu_correction = ReadImuCorrection(&imu);
  }
  parts.found.push_back(root->place());
}

struct CalibrationForm {
  const char* name;
  bool (*is)(const YamlSection& root);
  void (*read)(YamlSection* root, Gathered* gathered);
};

bool IsKalibrChain(const YamlSection& root) {
  if (!root.Has("cam0")) return root.Has("cam1");
  YamlSection section = root;
  const YamlSection camera = section.Section("cam0");
  return std::ranges::any_of(
      std::array{"intrinsics", "camera_model", "distortion_model", "resolution"},
      [&](const char* key) { return camera.Has(key); });
}

const CalibrationForm kForms[] = {
    {"ROS camera_info", [](const YamlSection& root) { return root.Has("camera_matrix"); }, ReadRos},
    {"ORB-SLAM3", [](const YamlSection& root) { return root.Has("Camera1.fx"); }, ReadOrbSlam},
    {"VINS",
     [](const YamlSection& root) {
       return root.Has("cam0_calib") || root.Has("body_T_cam0") || root.Has("extrinsicRotation");
     },
     ReadVins},
    {"camera of VINS", [](const YamlSection& root) { return root.Has("model_type"); },
     ReadVinsCameraFile},
    {"Basalt", [](const YamlSection& root) { return root.Has("value0") || root.Has("T_imu_cam"); },
     ReadBasalt},
    {"OpenCV",
     [](const YamlSection& root) {
       return root.Has("D1") || root.Has("distCoeffs1") || (root.Has("R") && root.Has("T"));
     },
     ReadOpenCv},
    {"part of a Kalibr chain",
     [](const YamlSection& root) {
       return root.Has("imu0") || root.Has("cam0") || root.Has(NoiseKeys().gyro_noise);
     },
     ReadKalibrPart}};

const CalibrationForm* FindForm(const YamlSection& root) {
  if (IsKalibrChain(root)) return nullptr;
  const auto form =
      std::ranges::find_if(kForms, [&](const CalibrationForm& known) { return known.is(root); });
  return form == std::end(kForms) ? nullptr : form;
}

// Both of ROS' cameras together tell how they stand.
void TakeInfoPoses(Gathered* gathered) {
  if (gathered->infos.size() != 2 || gathered->parts.T_left_right) return;
  gathered->parts.T_left_right =
      RightPoseFromInfo(gathered->infos[0], gathered->infos[1], ImageKind::kRaw);
  if (!gathered->parts.T_left_right) return;
  gathered->parts.found.push_back("their R and P");
  if (gathered->parts.T_left_right->translation.x() > 0) return;
  throw InputFault("calibration",
                   fmt::format("{}: found the right camera, expected the left one, as {} is the "
                               "left one's by P",
                               gathered->infos[0].place, gathered->infos[1].place),
                   "name the left camera's file first");
}

}  // namespace

std::vector<std::string> SplitCalibrationPaths(const std::string& path) {
  std::vector<std::string> paths;
  std::error_code error;
  if (std::filesystem::exists(path, error)) return {path};
  for (size_t from = 0, to = 0; to != std::string::npos; from = to + 1) {
    to = path.find(',', from);
    paths.push_back(path.substr(from, to == std::string::npos ? to : to - from));
  }
  return paths;
}

bool TellsParts(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return false;
  const std::vector<std::string> paths = SplitCalibrationPaths(path);
  return paths.size() > 2 || FindCalibrationForm(paths.front());
}

std::optional<std::string> FindCalibrationForm(const std::string& path) {
  return AsDataErrors([&]() -> std::optional<std::string> {
    const CalibrationForm* form = FindForm(YamlSection::FromFile(path));
    return form == nullptr ? std::nullopt : std::optional<std::string>(form->name);
  });
}

RigParts ReadRigParts(const std::vector<std::string>& paths, Mirrored mirrored) {
  return AsDataErrors([&] {
    Gathered gathered{.parts = {}, .infos = {}, .mirrored = mirrored};
    for (const std::string& path : paths) {
      YamlSection root = YamlSection::FromFile(path);
      const CalibrationForm* form = FindForm(root);
      if (form == nullptr) {
        throw InputFault("calibration",
                         path +
                             ": found a calibration of no form that can be read together with "
                             "others, expected ROS', ORB-SLAM3's, VINS', Basalt's, OpenCV's or "
                             "a part of Kalibr's",
                         "name a whole Kalibr chain alone, or files of these forms");
      }
      form->read(&root, &gathered);
    }
    TakeInfoPoses(&gathered);
    return gathered.parts;
  });
}

}  // namespace slcmap::data
