// slcmap calibration: reads a calibration of any form, shows it and writes it as a Kalibr chain.
#include "data/calibration/calibration.h"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/rig/bag_calibration.h"
#include "data/rig/topics.h"

namespace slcmap::inline commands {
namespace {

struct CalibrationArguments {
  std::vector<std::string> files;
  std::vector<int> cameras;
  std::string topics, output;
};

std::string ShowTransform(const RigidTransform& pose) {
  const Eigen::Vector3d turn_deg = kDegreesPerRadian * LogRotation(pose.rotation);
  const Eigen::Vector3d& at = pose.translation;
  return fmt::format("{:.4f} {:.4f} {:.4f} m, turned by {:.2f} {:.2f} {:.2f} degrees", at.x(),
                     at.y(), at.z(), turn_deg.x(), turn_deg.y(), turn_deg.z());
}

std::string ShowCamera(const Camera& camera) {
  const CameraWords words = DescribeCamera(camera);
  return fmt::format("{} x {} px, {} {}, focal length {:.2f} {:.2f} px, centre {:.2f} {:.2f} px{}",
                     camera.width_px, camera.height_px, words.camera_model, words.distortion_model,
                     camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px,
                     words.coefficients.empty()
                         ? ""
                         : fmt::format(", coefficients {}", fmt::join(words.coefficients, " ")));
}

std::string CalibrationTable(const Calibration& calibration) {
  const Rig& rig = calibration.rig;
  std::string text = fmt::format("read        {}\n", calibration.source);
  for (size_t i = 0; i < static_cast<size_t>(CameraCount(rig)); ++i) {
    text += fmt::format("cam{}        {}\n", i, ShowCamera(rig.cameras[i]));
    text += fmt::format("T_imu_cam{}  {}\n", i, ShowTransform(rig.T_imu_camera[i]));
  }
  for (size_t i = 1; i < static_cast<size_t>(CameraCount(rig)); ++i) {
    const RigidTransform T_left_right = rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[i];
    text += fmt::format("baseline    {:.4f} m; {} at {}\n", T_left_right.translation.norm(),
                        i == 1 ? "the right camera" : fmt::format("cam{}", i),
                        ShowTransform(T_left_right));
  }
  const ImuNoise& noise = rig.imu_noise;
  text += fmt::format("offset      {:.2f} ms: stamp on the IMU's clock = camera stamp + this\n",
                      1e3 * rig.camera_time_offset_s);
  text += fmt::format(
      "IMU noise   gyroscope {:.3g} rad/s/sqrt(Hz), walk {:.3g}; accelerometer {:.3g} "
      "m/s^2/sqrt(Hz), walk {:.3g}{}\n",
      noise.gyro_noise_rad_s_sqrthz, noise.gyro_walk_rad_s2_sqrthz, noise.accel_noise_m_s2_sqrthz,
      noise.accel_walk_m_s3_sqrthz, calibration.without_noise.empty() ? "" : " (typical)");
  return text;
}

Calibration ReadOfBag(const CalibrationArguments& arguments, Warnings* warnings) {
  const std::vector<std::string> beside(arguments.files.begin() + 1, arguments.files.end());
  const std::unique_ptr<Bag> bag = OpenBag(arguments.files.front());
  const RecordingTopics topics = ChooseTopics(bag.get(), ParseTopics(arguments.topics));
  for (const std::string& reason : topics.reasons) spdlog::info("{}", reason);
  return ReadBagCalibration(topics, fmt::format("{}", fmt::join(beside, ",")), bag.get(), warnings);
}

void ShowCalibration(CalibrationArguments arguments) {
  Warnings warnings;
  std::error_code error;
  const std::string asl = arguments.files.front() + "/mav0";
  if (std::filesystem::is_directory(asl, error)) arguments.files.front() = asl;
  const bool is_bag = IsBag(arguments.files.front());
  const Calibration calibration =
      is_bag ? ReadOfBag(arguments, &warnings)
             : ReadCalibration(fmt::format("{}", fmt::join(arguments.files, ",")), &warnings,
                               Mirrored::kRefused, arguments.cameras);
  LogWarnings(warnings);
  std::fputs(CalibrationTable(calibration).c_str(), stdout);
  if (arguments.output.empty()) return;
  for (const std::string& file : arguments.files) {
    if (!std::filesystem::equivalent(file, arguments.output, error)) continue;
    throw ConfigError(arguments.output + ": found a file that is read, expected a new name");
  }
  WriteKalibrCalibration(arguments.output, calibration.rig);
  spdlog::info("wrote {}", arguments.output);
}

}  // namespace

void AddCalibrationCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("calibration", "Show a calibration of any form, or write it as Kalibr's");
  const auto arguments = std::make_shared<CalibrationArguments>();
  command
      ->add_option("files", arguments->files,
                   "Kalibr, OpenVINS, ROS camera_info (left, then right), ORB-SLAM3, VINS, Basalt, "
                   "OpenCV, an ASL folder, or a bag; then files that tell what is missing")
      ->required();
  command->add_option("-o,--output", arguments->output, "Kalibr chain to write");
  command->add_option("--cameras", arguments->cameras, "Which cameras of a chain (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("I,J");
  command
      ->add_option("--topics", arguments->topics,
                   "Of a bag, which topics are the rig's; other= for each further camera")
      ->type_name("left=A,right=B,imu=C");
  command->footer(
      "Examples:\n  slcmap calibration left.yaml right.yaml imu_pose.yaml -o rig.yaml\n"
      "  slcmap calibration walk.bag -o rig.yaml\n\n"
      "All other commands take the same files with --calibration, several by commas.");
  command->callback([arguments] { ShowCalibration(*arguments); });
}

}  // namespace slcmap::commands
