#include "data/calibration/rig_parts.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <numeric>

#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

template <typename T>
void TakeMissing(const std::optional<T>& other, std::optional<T>* part) {
  if (!*part) *part = other;
}

// Poses that follow from others.
void DerivePoses(RigParts* parts) {
  auto &left = parts->T_imu_camera[0], &right = parts->T_imu_camera[1];
  if (!parts->T_left_right) return;
  if (left && !right) right = *left * *parts->T_left_right;
  if (right && !left) left = *right * parts->T_left_right->Inverse();
}

// Of the third camera on, those that are wanted.
std::vector<size_t> OthersMissing(const RigParts& parts, const std::vector<int>& wanted) {
  std::vector<size_t> missing;
  for (const int camera : wanted) {
    const auto i = static_cast<size_t>(camera);
    if (i > 1 && (!parts.cameras[i] || !parts.T_imu_camera[i])) missing.push_back(i);
  }
  return missing;
}

std::vector<std::string> ListMissing(const RigParts& parts, const std::vector<int>& wanted) {
  std::vector<std::string> missing;
  const bool stereo = parts.has_right;
  if (!parts.cameras[0]) missing.push_back("the left camera's intrinsics");
  if (stereo && !parts.cameras[1]) missing.push_back("the right camera's intrinsics");
  if (!parts.T_imu_camera[0]) missing.push_back("the left camera's pose to the IMU");
  if (stereo && !parts.T_imu_camera[1] && !parts.T_left_right) {
    missing.push_back("the right camera's pose to the left one");
  }
  for (const size_t i : OthersMissing(parts, wanted)) {
    if (!parts.cameras[i]) missing.push_back(fmt::format("cam{}'s intrinsics", i));
    if (!parts.T_imu_camera[i]) missing.push_back(fmt::format("cam{}'s pose to the IMU", i));
  }
  return missing;
}

// A file that says what is missing.
std::string ShowTemplate(const RigParts& parts, const std::vector<int>& wanted) {
  constexpr const char* kRows = "[[r, r, r, x], [r, r, r, y], [r, r, r, z], [0, 0, 0, 1]]";
  constexpr const char* kCamera =
      "camera_model: pinhole, intrinsics: [fx, fy, cx, cy], distortion_model: radtan, "
      "distortion_coeffs: [k1, k2, p1, p2], resolution: [w, h]";
  std::string text;
  const auto add = [&](int i, const std::string& keys) {
    text += fmt::format("{}cam{}: {{{}}}", text.empty() ? "" : " and ", i, keys);
  };
  const bool lacks_right_pose = parts.has_right && !parts.T_imu_camera[1] && !parts.T_left_right;
  if (!parts.cameras[0]) {
    add(0, std::string(kCamera) + ", T_imu_cam: " + kRows);
  } else if (!parts.T_imu_camera[0]) {
    add(0, std::string("T_imu_cam: ") + kRows);
  }
  if (parts.has_right && !parts.cameras[1]) {
    add(1, std::string(kCamera) + ", T_imu_cam: " + kRows);
  } else if (lacks_right_pose) {
    add(1, std::string("T_imu_cam: ") + kRows);
  }
  for (const size_t i : OthersMissing(parts, wanted)) {
    add(static_cast<int>(i), std::string(kCamera) + ", T_imu_cam: " + kRows);
  }
  return text;
}

// Those that are wanted, or all; of the left one alone nothing of the right one has to be known.
std::vector<int> ChooseParts(const std::vector<int>& wanted, const std::string& place,
                             RigParts* parts) {
  if (wanted == std::vector{0}) parts->has_right = false;
  const int count = parts->has_right ? static_cast<int>(parts->cameras.size()) : 1;
  const bool are_there = std::ranges::all_of(wanted, [&](int camera) {
    return camera >= 0 && camera < count && std::ranges::count(wanted, camera) == 1;
  });
  if (!are_there) {
    throw InputFault("cameras",
                     fmt::format("--cameras: found {}, expected {} of {}", fmt::join(wanted, ","),
                                 count == 1   ? "0"
                                 : count == 2 ? "0, 1 or both"
                                              : fmt::format("some of 0 to {}", count - 1),
                                 place),
                     "name cameras that the calibration has, as --cameras 0,1");
  }
  if (!wanted.empty()) return wanted;
  std::vector<int> all(static_cast<size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

std::string Join(const std::vector<std::string>& words) {
  return words.empty() ? "nothing" : fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

void AddParts(const RigParts& others, RigParts* parts) {
  parts->Reserve(others.cameras.size());
  for (size_t i = 0; i < others.cameras.size(); ++i) {
    TakeMissing(others.cameras[i], &parts->cameras[i]);
    TakeMissing(others.T_imu_camera[i], &parts->T_imu_camera[i]);
    TakeMissing(others.readout_s[i], &parts->readout_s[i]);
  }
  TakeMissing(others.T_left_right, &parts->T_left_right);
  TakeMissing(others.camera_time_offset_s, &parts->camera_time_offset_s);
  TakeMissing(others.imu_noise, &parts->imu_noise);
  TakeMissing(others.imu_correction, &parts->imu_correction);
  parts->has_right = parts->has_right && others.has_right;
  parts->found.insert(parts->found.end(), others.found.begin(), others.found.end());
}

bool IsWhole(const RigParts& some) {
  RigParts parts = some;
  DerivePoses(&parts);
  std::vector<int> all(parts.cameras.size());
  std::iota(all.begin(), all.end(), 0);
  return ListMissing(parts, all).empty();
}

Calibration MakeCalibration(const RigParts& some, const std::string& place,
                            const std::vector<int>& wanted) {
  RigParts parts = some;
  const std::vector<int> cameras = ChooseParts(wanted, place, &parts);
  DerivePoses(&parts);
  const std::vector<std::string> missing = ListMissing(parts, cameras);
  if (!missing.empty()) {
    throw InputFault(
        "calibration",
        fmt::format("{}: found {}; missing is {}", place, Join(parts.found), Join(missing)),
        fmt::format("say it in rig.yaml, which is named with --calibration (beside what was "
                    "found, by commas): {}, T_imu_cam with a rotation and metres, from the "
                    "camera's frame to the IMU's; or name a whole Kalibr chain",
                    ShowTemplate(parts, cameras)));
  }
  Calibration calibration;
  Rig& rig = calibration.rig;
  calibration.cameras = cameras;
  rig.Resize(cameras.size());
  for (size_t i = 0; i < cameras.size(); ++i) {
    const auto of = static_cast<size_t>(cameras[i]);
    rig.cameras[i] = *parts.cameras[of];
    rig.T_imu_camera[i] = *parts.T_imu_camera[of];
    rig.readout_s[i] = parts.readout_s[of].value_or(0);
  }
  rig.camera_time_offset_s = parts.camera_time_offset_s.value_or(0);
  rig.imu_correction = parts.imu_correction.value_or(ImuCorrection());
  if (parts.imu_noise) rig.imu_noise = *parts.imu_noise;
  if (!parts.imu_noise) calibration.without_noise = place;
  CheckRig(rig, place);
  calibration.source =
      fmt::format("{} ({}, timeshift {} s), IMU noise {}{}", place, Join(parts.found),
                  rig.camera_time_offset_s, parts.imu_noise ? "as said there" : "assumed",
                  IsIdentity(rig.imu_correction) ? "" : ", IMU's scale and axes corrected");
  return calibration;
}

}  // namespace slcmap::data
