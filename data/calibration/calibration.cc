#include "data/calibration/calibration.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core/types.hpp>
#include <optional>
#include <vector>

#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/calibration/imu_calibration.h"
#include "data/calibration/other_calibrations.h"
#include "data/calibration/rig_parts.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxTransformError_m = 0.01;  // between two entries that say the same
constexpr double kMaxTransformError_rad = 0.01;
constexpr double kMinBaseline_m = 0.005, kMaxBaseline_m = 1.5;
constexpr int kMaxCameras = 10;     // of a chain
constexpr double kMaxLever_m = 10;  // from the IMU to a camera
constexpr double kMaxTimeOffset_s = 1;

// The keys that ASL and Kalibr share, with the name that each gives to the coefficients.
Camera ReadCamera(YamlSection& section, const std::string& coefficients_key) {
  CameraWords words{"pinhole", "none", {}, {}};
  section.Read("camera_model", &words.camera_model);
  words.intrinsics = RequiredValue<std::vector<double>>(section, "intrinsics");
  if (words.camera_model == "pinhole" || section.Has("distortion_model")) {
    words.distortion_model = RequiredValue<std::string>(section, "distortion_model");
  }
  const bool is_basalts = words.camera_model == "kb4" || words.camera_model == "pinhole-radtan8";
  if (section.Has(coefficients_key) || (words.distortion_model != "none" && !is_basalts)) {
    words.coefficients = RequiredValue<std::vector<double>>(section, coefficients_key);
  }
  CameraFault fault;
  std::optional<Camera> camera = GetCamera(words, &fault);
  if (!camera) {
    const std::string key = fault.key == "coefficients" ? coefficients_key : fault.key;
    throw CalibrationFault(
        section, key, fmt::format("found {}, expected {}", fault.found, fault.expected),
        fmt::format("write {} as {}", fault.expected, KeyInFile(section.place(), key)));
  }
  const cv::Size resolution = RequiredResolution(section);
  camera->width_px = resolution.width;
  camera->height_px = resolution.height;
  camera->Check(section.place());
  return *camera;
}

void RequireEqual(const RigidTransform& a, const RigidTransform& b, const std::string& place,
                  const std::string& what) {
  const RigidTransform difference = a.Inverse() * b;
  const double angle_rad = LogRotation(difference.rotation).norm();
  if (difference.translation.norm() > kMaxTransformError_m || angle_rad > kMaxTransformError_rad) {
    throw InputFault(
        "calibration",
        fmt::format("{}: found {} that disagree by {:.3f} m and {:.3f} rad, expected one "
                    "of them only",
                    place, what, difference.translation.norm(), angle_rad),
        fmt::format("leave one of T_imu_cam, T_cam_imu and T_cn_cnm1 in {}", place));
  }
}

// The pose of a Kalibr camera by the entries it has; adds to *source which ones were read.
RigidTransform ReadKalibrPose(YamlSection& camera, int index,
                              const std::optional<RigidTransform>& T_imu_previous,
                              Mirrored mirrored, std::string* source) {
  std::optional<RigidTransform> T_imu_camera;
  const auto take = [&](const std::string& key, const RigidTransform& pose) {
    if (T_imu_camera) {
      RequireEqual(*T_imu_camera, pose, camera.place(), "a " + key + " and another transform");
      return;
    }
    T_imu_camera = pose;
    *source += fmt::format("{}{} of cam{}", source->empty() ? "" : ", ", key, index);
  };
  if (camera.Has("T_imu_cam"))
    take("T_imu_cam", RequiredTransform(camera, "T_imu_cam", false, mirrored));
  if (camera.Has("T_cam_imu")) {
    take("T_cam_imu", RequiredTransform(camera, "T_cam_imu", false, mirrored).Inverse());
  }
  if (T_imu_previous && camera.Has("T_cn_cnm1")) {
    take("T_cn_cnm1",
         *T_imu_previous * RequiredTransform(camera, "T_cn_cnm1", false, mirrored).Inverse());
  }
  if (!T_imu_camera) {
    throw CalibrationFault(
        camera, "T_cam_imu",
        fmt::format("missing, expected it or T_imu_cam{}", T_imu_previous ? " or T_cn_cnm1" : ""),
        fmt::format("add {}; Kalibr's camera-IMU calibration gives it",
                    KeyInFile(camera.place(), "T_cam_imu")));
  }
  return *T_imu_camera;
}

// Takes the cameras and IMUs of a file, whoever reads them.
void SkipSensors(YamlSection* root) {
  YamlSection all = *root;
  for (const std::string& key : all.Keys()) {
    const std::string kind = key.substr(0, 3);
    if (key.size() == 4 && (kind == "cam" || kind == "imu")) root->Skip(key);
  }
}

// The IMU that is read is imu0, or one whose pose and clock against it are given: then cameras are
// brought to its frame and its clock.
void ReadKalibrImu(const std::string& path, Mirrored mirrored, Rig* rig) {
  YamlSection root = YamlSection::FromFile(path);
  YamlSection imu = root.Has("imu0") ? root.Section("imu0") : root;
  const bool asl_rate = imu.Has("rate_hz") && !imu.Has("update_rate");
  ReadNoise(imu, {.rate = asl_rate ? "rate_hz" : "update_rate"}, &rig->imu_noise);
  rig->imu_correction = ReadImuCorrection(&imu);
  if (imu.Has("T_i_b")) {
    const RigidTransform T_imu_body = RequiredTransform(imu, "T_i_b", false, mirrored);
    if (!T_imu_body.Matrix().isIdentity(0)) {
      for (RigidTransform& pose : rig->T_imu_camera) pose = T_imu_body * pose;
    }
  }
  double time_offset_s = 0;  // stamp of imu0 = stamp of this + offset
  imu.Read("time_offset", &time_offset_s);
  if (!(std::abs(time_offset_s) <= kMaxTimeOffset_s)) {
    throw CalibrationFault(
        imu, "time_offset",
        fmt::format("found {} s, expected at most {} s either way", time_offset_s,
                    kMaxTimeOffset_s),
        fmt::format("write {} in seconds", KeyInFile(imu.place(), "time_offset")));
  }
  rig->camera_time_offset_s -= time_offset_s;
  for (const char* key : {"T_i_b", "rostopic"}) imu.Skip(key);
  imu.Finish();
  SkipSensors(&root);
  if (root.Has("imu0")) root.Finish();
}

// Makes the rig of the cameras that are used.
void TakeCameras(const std::vector<ChainCamera>& chain, const std::vector<int>& wanted,
                 Calibration* calibration, Warnings* warnings) {
  std::vector<const ChainCamera*> used;
  for (const size_t i : ChooseCameras(chain, wanted)) used.push_back(&chain[i]);
  calibration->cameras = {};
  calibration->rig.Resize(used.size());
  for (size_t i = 0; i < used.size(); ++i) {
    calibration->rig.cameras[i] = used[i]->camera;
    calibration->rig.T_imu_camera[i] = used[i]->T_imu_camera;
    calibration->cameras.push_back(used[i]->index);
    calibration->source += (i == 0 ? "" : ", ") + used[i]->source;
  }
  TakeTimes(used, &calibration->rig, warnings);
  if (chain.size() <= used.size()) return;
  calibration->source +=
      fmt::format("; cameras {} of {}", fmt::join(calibration->cameras, ", "), chain.size());
}

// Keys that say nothing that is needed are passed over; any other is an error.
void FinishCamera(YamlSection* camera, const std::vector<std::string>& not_needed) {
  for (const std::string& key : not_needed) camera->Skip(key);
  camera->Finish();
}

std::string CorrectedWords(const Rig& rig) {
  return IsIdentity(rig.imu_correction) ? "" : ", IMU's scale and axes corrected";
}

bool Exists(const fs::path& path) {
  std::error_code error;  // such as a loop of links
  return fs::exists(path, error);
}

std::string FirstExisting(const std::vector<fs::path>& folders,
                          const std::vector<std::string>& names) {
  std::error_code error;
  for (const fs::path& folder : folders) {
    for (const std::string& name : names) {
      if (fs::is_regular_file(folder / name, error)) return (folder / name).string();
    }
  }
  return "";
}

const std::vector<std::string> kCamchainNames = {"camchain.yaml", "camchain-imucam.yaml",
                                                 "kalibr_imucam_chain.yaml"};
const std::vector<std::string> kImuNames = {"imu_config.yaml", "imu.yaml", "imu0.yaml",
                                            "kalibr_imu_chain.yaml"};

// Kalibr names what belongs together alike: camchain-imucam-BAG.yaml and imu-BAG.yaml.
std::vector<std::string> ImuNamesBeside(const std::string& camchain_path) {
  std::vector<std::string> names = kImuNames;
  std::string name = fs::path(camchain_path).filename().string();
  const std::string chain = "camchain-imucam";
  const size_t at = name.find(chain);
  if (at != std::string::npos) names.insert(names.begin(), name.replace(at, chain.size(), "imu"));
  return names;
}

std::string KalibrMatrix(const char* key, const RigidTransform& transform) {
  const Eigen::Matrix4d m = transform.Matrix();
  std::string text = fmt::format("  {}:\n", key);
  for (int r = 0; r < 4; ++r) {
    text += fmt::format("  - [{}, {}, {}, {}]\n", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
  }
  return text;
}

std::string KalibrCamera(const std::string& name, const Camera& camera,
                         const RigidTransform& T_imu_camera, double time_offset_s,
                         double readout_s) {
  const CameraWords words = DescribeCamera(camera);
  return fmt::format(
      "{}:\n{}  camera_model: {}\n  distortion_coeffs: [{}]\n  distortion_model: {}\n"
      "  intrinsics: [{}]\n{}  resolution: [{}, {}]\n  timeshift_cam_imu: {}\n",
      name, KalibrMatrix("T_cam_imu", T_imu_camera.Inverse()), words.camera_model,
      fmt::join(words.coefficients, ", "), words.distortion_model,
      fmt::join(words.intrinsics, ", "),
      readout_s == 0 ? "" : fmt::format("  {}: {}\n", kReadoutKey, readout_s), camera.width_px,
      camera.height_px, time_offset_s);
}

// Files that say nothing of a right camera are those of a rig of one.
Calibration ReadPartsAlone(const std::vector<std::string>& paths, const std::string& place,
                           Mirrored mirrored, const std::vector<int>& cameras, Warnings* warnings) {
  RigParts parts = ReadRigParts(paths, mirrored, warnings);
  const bool tells_right = parts.cameras[1] || parts.T_imu_camera[1] || parts.T_left_right;
  if (!tells_right) parts.has_right = false;
  return MakeCalibration(parts, place, cameras);
}

}  // namespace

void CheckRig(const Rig& rig, const std::string& place) {
  for (const auto& [first, is_pair] : CameraGroups(rig)) {
    const double baseline_m =
        is_pair
            ? (rig.T_imu_camera[first].translation - rig.T_imu_camera[first + 1].translation).norm()
            : kMinBaseline_m;
    if (baseline_m >= kMinBaseline_m && baseline_m <= kMaxBaseline_m) continue;
    throw InputFault("calibration",
                     fmt::format("{}: found a baseline of {:.4g} m, expected {} to {} m", place,
                                 baseline_m, kMinBaseline_m, kMaxBaseline_m),
                     fmt::format("correct the translations of cam{} and cam{} in {} (T_BS, "
                                 "T_cam_imu or T_imu_cam): metres, not millimetres or squares of "
                                 "a chessboard, and not the "
                                 "same twice; or name two that are apart with --cameras, or one",
                                 first, first + 1, place));
  }
  for (size_t i = 0; i < rig.T_imu_camera.size(); ++i) {
    const double lever_m = rig.T_imu_camera[i].translation.norm();
    if (!(lever_m <= kMaxLever_m)) {
      throw InputFault("calibration",
                       fmt::format("{}: found cam{} {:.4g} m from the IMU, expected at most {} m",
                                   place, i, lever_m, kMaxLever_m),
                       fmt::format("correct the translation of cam{} in {} (T_BS, T_cam_imu or "
                                   "T_imu_cam): metres, not millimetres",
                                   i, place));
    }
  }
  if (!(std::abs(rig.camera_time_offset_s) <= kMaxTimeOffset_s)) {
    throw InputFault(
        "calibration",
        fmt::format("{}: timeshift_cam_imu: found {} s, expected at most {} s either way", place,
                    rig.camera_time_offset_s, kMaxTimeOffset_s),
        fmt::format("write timeshift_cam_imu of cam0 in {} in seconds; bring the stamps of both to "
                    "one clock first",
                    place));
  }
}

Calibration ReadAslCalibration(const std::string& folder, Warnings* warnings, Mirrored mirrored,
                               const std::vector<int>& cameras) {
  return AsDataErrors([&] {
    Calibration calibration;
    Rig& rig = calibration.rig;
    RigidTransform T_body_imu;
    const std::string imu_path = folder + "/imu0/sensor.yaml";
    if (Exists(imu_path)) {
      YamlSection imu = YamlSection::FromFile(imu_path);
      if (imu.Has("T_BS")) T_body_imu = RequiredTransform(imu, "T_BS", true, mirrored);
      ReadNoise(imu, {.rate = "rate_hz"}, &rig.imu_noise);
      rig.imu_correction = ReadImuCorrection(&imu);
      for (const char* key : {"T_BS", "sensor_type", "comment"}) imu.Skip(key);
      imu.Finish();
    } else {
      calibration.without_noise = imu_path;
    }
    std::vector<ChainCamera> chain;
    for (int i = 0; i < kMaxCameras; ++i) {
      if (i > 0 && !Exists(fmt::format("{}/cam{}/sensor.yaml", folder, i))) continue;
      const bool is_wanted = cameras.empty() || std::ranges::count(cameras, i) > 0;
      if (i > 1 && !is_wanted) continue;
      YamlSection camera = YamlSection::FromFile(fmt::format("{}/cam{}/sensor.yaml", folder, i));
      chain.push_back({i, ReadCamera(camera, "distortion_coefficients"),
                       T_body_imu.Inverse() * RequiredTransform(camera, "T_BS", true, mirrored),
                       std::nullopt, camera.place(), fmt::format("cam{}", i)});
      ReadTimes(&camera, &chain.back());
      FinishCamera(&camera, {"sensor_type", "comment", "rate_hz", "distortion_coefficients"});
    }
    if (chain.size() == 1 && Exists(folder + "/cam1")) {
      YamlSection::FromFile(folder + "/cam1/sensor.yaml");  // which says what is missing
    }
    TakeCameras(chain, cameras, &calibration, warnings);
    CheckRig(rig, folder);
    calibration.source = fmt::format("{}/*/sensor.yaml (T_BS of {}, imu0){}", folder,
                                     calibration.source, CorrectedWords(rig));
    return calibration;
  });
}

Calibration ReadKalibrCalibration(const std::string& camchain_path, const std::string& imu_path,
                                  Warnings* warnings, Mirrored mirrored,
                                  const std::vector<int>& cameras) {
  return AsDataErrors([&] {
    Calibration calibration;
    Rig& rig = calibration.rig;
    YamlSection root = YamlSection::FromFile(camchain_path);
    std::vector<ChainCamera> chain;
    for (int i = 0; i < kMaxCameras; ++i) {
      const std::string name = fmt::format("cam{}", i);
      if (i > 0 && !root.Has(name)) continue;
      if (!root.Has(name)) {
        throw CalibrationFault(
            root, name, "missing, expected cam0 and cam1",
            fmt::format("name a Kalibr camera chain instead of {}, or add {} to it", camchain_path,
                        name));
      }
      YamlSection camera = root.Section(name);
      ChainCamera& read = chain.emplace_back(ChainCamera{
          i, ReadCamera(camera, "distortion_coeffs"), {}, std::nullopt, camera.place()});
      ReadTimes(&camera, &read);
      const auto previous = std::ranges::find(chain, i - 1, &ChainCamera::index);
      read.T_imu_camera = ReadKalibrPose(
          camera, i, previous == chain.end() ? std::nullopt : std::optional(previous->T_imu_camera),
          mirrored, &read.source);
      FinishCamera(&camera, {"rostopic", "cam_overlaps", "distortion_coeffs", "T_cam_imu",
                             "T_imu_cam", "T_cn_cnm1"});
    }
    TakeCameras(chain, cameras, &calibration, warnings);
    SkipSensors(&root);
    root.Finish();
    if (imu_path.empty()) {
      calibration.without_noise = camchain_path;
    } else {
      ReadKalibrImu(imu_path, mirrored, &rig);
    }
    CheckRig(rig, camchain_path);
    calibration.source =
        fmt::format("{} ({}, timeshift {} s), IMU noise {}", camchain_path, calibration.source,
                    rig.camera_time_offset_s, imu_path.empty() ? "assumed" : imu_path) +
        CorrectedWords(rig);
    return calibration;
  });
}

void WriteKalibrCalibration(const std::string& path, const Rig& rig) {
  std::string text;
  for (int i = 0; i < CameraCount(rig); ++i) {
    const double shift_s = rig.camera_time_offset_s + TimeOffset_s(rig, i);
    text += KalibrCamera(fmt::format("cam{}", i), rig.cameras[i], rig.T_imu_camera[i], shift_s,
                         rig.readout_s[i]);
    if (i > 0) {
      text += KalibrMatrix("T_cn_cnm1", rig.T_imu_camera[i].Inverse() * rig.T_imu_camera[i - 1]);
    }
  }
  const ImuNoise& noise = rig.imu_noise;
  text += fmt::format(
      "imu0:\n  accelerometer_noise_density: {}\n  accelerometer_random_walk: {}\n"
      "  gyroscope_noise_density: {}\n  gyroscope_random_walk: {}\n  update_rate: {}\n",
      noise.accel_noise_m_s2_sqrthz, noise.accel_walk_m_s3_sqrthz, noise.gyro_noise_rad_s_sqrthz,
      noise.gyro_walk_rad_s2_sqrthz, noise.rate_hz);
  text += KalibrImuCorrection(rig.imu_correction);
  WriteFile(path, text);
}

Calibration FindCalibration(const std::string& asl_folder, Warnings* warnings, Mirrored mirrored,
                            const std::vector<int>& cameras) {
  if (Exists(fs::path(asl_folder) / "cam0" / "sensor.yaml")) {
    return ReadAslCalibration(asl_folder, warnings, mirrored, cameras);
  }
  const fs::path folder(asl_folder), above = fs::absolute(folder).lexically_normal().parent_path();
  const std::vector<fs::path> folders = {folder, folder / "dso", above, above / "dso"};
  const std::string camchain_path = FirstExisting(folders, kCamchainNames);
  if (camchain_path.empty()) {
    throw InputFault("calibration",
                     asl_folder +
                         ": found no calibration, expected cam0/sensor.yaml or dso/camchain.yaml "
                         "beside it (or name one with --calibration)",
                     fmt::format("write {0}/cam0/sensor.yaml, {0}/cam1/sensor.yaml and "
                                 "{0}/imu0/sensor.yaml, or name a Kalibr chain with --calibration",
                                 asl_folder));
  }
  return ReadKalibrCalibration(camchain_path, FirstExisting(folders, kImuNames), warnings, mirrored,
                               cameras);
}

Calibration ReadCalibration(const std::string& path, Warnings* warnings, Mirrored mirrored,
                            const std::vector<int>& cameras) {
  std::error_code error;
  if (fs::is_directory(path, error)) return FindCalibration(path, warnings, mirrored, cameras);
  const std::vector<std::string> paths = SplitCalibrationPaths(path);
  if (TellsParts(path)) return ReadPartsAlone(paths, path, mirrored, cameras, warnings);
  if (paths.size() == 2) {
    return ReadKalibrCalibration(paths[0], paths[1], warnings, mirrored, cameras);
  }
  const std::string imu_path = AsDataErrors([&] {
    return YamlSection::FromFile(path).Has("imu0")
               ? path
               : FirstExisting({fs::path(path).parent_path()}, ImuNamesBeside(path));
  });
  return ReadKalibrCalibration(path, imu_path, warnings, mirrored, cameras);
}

}  // namespace slcmap::data
