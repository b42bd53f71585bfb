#include "data/calibration/other_calibrations.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "data/calibration/calibration_forms.h"
#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {
// The left camera, then the right one.
void TakeCamera(const Camera& camera, const std::string& place, Gathered* gathered) {
  const size_t i = gathered->cameras++;
  if (i > 1) {
    throw InputFault("calibration", place + ": found a third camera, expected left and right",
                     "name the files of the two cameras of the pair");
  }
  gathered->parts.cameras[i] = camera;
  gathered->parts.found.push_back(fmt::format("{} camera of {}", i == 0 ? "left" : "right", place));
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

namespace {

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
  TakeCamera(CameraFromInfo(info, ImageKind::kRaw), info.place, gathered);
  gathered->infos.push_back(info);
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
    TakeCamera(RequiredCamera(words, size, root->place()), root->place(), gathered);
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
    if (camera.Has(kReadoutKey)) parts.readout_s[static_cast<size_t>(i)] = ReadReadout(camera);
    for (const char* key : {"timeshift_cam_imu", "rostopic", "cam_overlaps", "T_cam_imu"})
      camera.Skip(key);
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

void RefuseOldOrbSlam(YamlSection* root, Gathered*) {
  throw InputFault(
      "calibration",
      root->place() +
          ": found Camera.fx, as files of ORB-SLAM2 and of ORB-SLAM3 before 1.0 have it, "
          "expected a form that is read",
      "name the calibration that it was made of, or a file of ORB-SLAM3 1.0 "
      "(Camera1.fx, Camera2.fx, Stereo.T_c1_c2, IMU.T_b_c1)");
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
    {"ORB-SLAM2", [](const YamlSection& root) { return root.Has("Camera.fx"); }, RefuseOldOrbSlam},
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

// Of two files that tell the same, which is right is not known.
void RefuseTwice(const RigParts& one, const std::string& of_one, const RigParts& other,
                 const std::string& of_other) {
  const auto refuse = [&](bool both, const char* what) {
    if (!both) return;
    throw InputFault(
        "calibration",
        fmt::format("{}: found {}, which {} tells as well, expected it once", of_other, what,
                    of_one),
        fmt::format("leave it out of {} or {}, or name one of them", of_one, of_other));
  };
  for (const size_t i : {0, 1}) {
    const char* const side = i == 0 ? "left" : "right";
    refuse(one.cameras[i] && other.cameras[i], fmt::format("the {} camera", side).c_str());
    refuse(one.T_imu_camera[i] && other.T_imu_camera[i],
           fmt::format("the {} camera's pose to the IMU", side).c_str());
  }
  refuse(one.T_left_right && other.T_left_right, "the right camera's pose to the left one");
  refuse(one.imu_noise && other.imu_noise, "the IMU's noise");
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

// A file of VINS names those of its cameras, and says which is left: named beside it, they are no
// others.
std::vector<YamlSection> ReadFiles(const std::vector<std::string>& paths) {
  namespace fs = std::filesystem;
  std::vector<YamlSection> roots;
  std::set<fs::path> cameras;
  for (const std::string& path : paths) {
    YamlSection& root = roots.emplace_back(YamlSection::FromFile(path));
    for (const char* key : {"cam0_calib", "cam1_calib"}) {
      if (!root.Has(key)) continue;
      cameras.insert(fs::weakly_canonical(fs::path(path).parent_path() /
                                          RequiredValue<std::string>(root, key)));
    }
  }
  std::erase_if(roots, [&](const YamlSection& root) {
    return cameras.contains(fs::weakly_canonical(root.place()));
  });
  return roots;
}

}  // namespace

std::vector<std::string> SplitCalibrationPaths(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error) ? std::vector{path} : SplitAtCommas(path);
}

bool TellsParts(const std::string& path) {
  std::error_code error;
  if (path.empty() || std::filesystem::is_directory(path, error)) return false;
  const std::vector<std::string> paths = SplitCalibrationPaths(path);
  return paths.size() > 2 || FindCalibrationForm(paths.front());
}

std::optional<std::string> FindCalibrationForm(const std::string& path) {
  return AsDataErrors([&]() -> std::optional<std::string> {
    const CalibrationForm* form = FindForm(YamlSection::FromFile(path));
    return form == nullptr ? std::nullopt : std::optional<std::string>(form->name);
  });
}

RigParts ReadRigParts(const std::vector<std::string>& paths, Mirrored mirrored,
                      Warnings* warnings) {
  return AsDataErrors([&] {
    Gathered gathered;
    gathered.mirrored = mirrored;
    gathered.warnings = warnings;
    std::vector<YamlSection> roots = ReadFiles(paths);
    std::vector<RigParts> told;  // by each file
    for (YamlSection& root : roots) {
      const CalibrationForm* form = FindForm(root);
      if (form == nullptr) {
        throw InputFault("calibration",
                         root.place() +
                             ": found a calibration of no form that can be read together with "
                             "others, expected ROS', ORB-SLAM3's, VINS', Basalt's, OpenCV's or "
                             "a part of Kalibr's",
                         "name a whole Kalibr chain alone, or files of these forms");
      }
      gathered.parts = {};
      form->read(&root, &gathered);
      for (size_t i = 0; i < told.size(); ++i) {
        RefuseTwice(told[i], roots[i].place(), gathered.parts, root.place());
      }
      told.push_back(gathered.parts);
    }
    gathered.parts = {};
    for (const RigParts& parts : told) AddParts(parts, &gathered.parts);
    TakeInfoPoses(&gathered);
    return gathered.parts;
  });
}

}  // namespace slcmap::data
