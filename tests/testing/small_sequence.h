// A small EuRoC sequence on disk for tests of readers: random textures of 96x64, IMU lying still.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

inline constexpr int64_t kFirstStamp_ns = 1403636580000000000;
inline constexpr int64_t kImageStep_ns = 50000000;
inline constexpr int64_t kImuStep_ns = 5000000;

inline int64_t ImageStamp(int index) { return kFirstStamp_ns + index * kImageStep_ns; }

// ASL's sensor.yaml of a camera looking along the body's x axis, displaced along its -y.
inline std::string SensorYaml(double y_m) {
  return fmt::format(
      "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [0, 0, 1, 0, -1, 0, 0, {}, 0, -1, 0, 0, 0, 0, 0, 1]\n"
      "rate_hz: 20\nresolution: [96, 64]\ncamera_model: pinhole\n"
      "intrinsics: [60, 60, 47.5, 31.5]\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.1, 0.01, 0.0, 0.0]\n",
      y_m);
}

inline const char* kImuYaml =
    "rate_hz: 200\ngyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2e-5\n"
    "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n";

inline std::string ImuRow(int64_t stamp_ns) {
  return fmt::format("{},0.001,0.002,-0.001,0.02,-0.01,9.81", stamp_ns);
}

// Random blocks, the same for one seed; right images show them shifted by 4 px.
inline cv::Mat Texture(int seed, int shift_px) {
  cv::RNG rng(seed + 1);
  cv::Mat blocks(16, 26, CV_8U), large;
  rng.fill(blocks, cv::RNG::UNIFORM, 0, 255);
  cv::resize(blocks, large, cv::Size(), 4, 4, cv::INTER_CUBIC);
  return large(cv::Rect(shift_px, 0, 96, 64)).clone();
}

// Writes mav0 under the folder: images in cam0 and cam1, and IMU samples around them.
inline void WriteSequence(const TempFolder& folder, int images, const std::string& end = "\n") {
  std::string rows = "#timestamp [ns],filename" + end;
  std::string imu = "#timestamp [ns],wx,wy,wz,ax,ay,az" + end;
  for (int i = 0; i < images; ++i) {
    rows += fmt::format("{0},{0}.png{1}", ImageStamp(i), end);
    for (int camera = 0; camera < 2; ++camera) {
      const std::string name = fmt::format("mav0/cam{}/data/{}.png", camera, ImageStamp(i));
      folder.Write(name, "");
      cv::imwrite(folder.Path(name), Texture(i, camera == 0 ? 0 : 4));
    }
  }
  for (int64_t t = kFirstStamp_ns - 4 * kImuStep_ns; t <= ImageStamp(images); t += kImuStep_ns) {
    imu += ImuRow(t) + end;
  }
  for (int camera = 0; camera < 2; ++camera) {
    folder.Write(fmt::format("mav0/cam{}/data.csv", camera), rows);
    folder.Write(fmt::format("mav0/cam{}/sensor.yaml", camera), SensorYaml(-0.1 * camera));
  }
  folder.Write("mav0/imu0/data.csv", imu);
  folder.Write("mav0/imu0/sensor.yaml", kImuYaml);
}

}  // namespace slcmap::testing
