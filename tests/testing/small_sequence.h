// A small EuRoC sequence on disk for tests of readers: random textures of 96x64, IMU lying still.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

inline constexpr int64_t kFirstStamp_ns = 1403636580000000000;
inline constexpr int64_t kImageStep_ns = 50000000;
inline constexpr int64_t kImuStep_ns = 5000000;

inline int64_t ImageStamp(int index) { return kFirstStamp_ns + index * kImageStep_ns; }

struct SmallSequence {
  int images = 5;
  cv::Size size = {96, 64};  // multiples of 4
  bool still = false;        // all images alike, as seen by a rig at rest
  std::string line_end = "\n";
};

// ASL's sensor.yaml of a camera looking along the body's x axis, displaced along y.
inline std::string SensorYaml(double y_m, const cv::Size& size = {96, 64}) {
  return fmt::format(
      "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [0, 0, 1, 0, -1, 0, 0, {}, 0, -1, 0, 0, 0, 0, 0, 1]\n"
      "rate_hz: 20\nresolution: [{}, {}]\ncamera_model: pinhole\n"
      "intrinsics: [60, 60, {}, {}]\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.1, 0.01, 0.0, 0.0]\n",
      y_m, size.width, size.height, 0.5 * (size.width - 1), 0.5 * (size.height - 1));
}

inline const char* kImuYaml =
    "rate_hz: 200\ngyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2e-5\n"
    "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n";

inline std::string ImuRow(int64_t stamp_ns) {
  return fmt::format("{},0.001,0.002,-0.001,0.02,-0.01,9.81", stamp_ns);
}

// Random blocks, the same for one seed, moved to the left by shift_px (at most 8).
inline cv::Mat Texture(int seed, int shift_px, const cv::Size& size = {96, 64}) {
  cv::RNG rng(seed + 1);
  cv::Mat blocks(size.height / 4, size.width / 4 + 2, CV_8U), large;
  rng.fill(blocks, cv::RNG::UNIFORM, 0, 255);
  cv::resize(blocks, large, cv::Size(), 4, 4, cv::INTER_CUBIC);
  return large(cv::Rect(cv::Point(shift_px, 0), size)).clone();
}

// Writes image `index` of both cameras, the right one's content 4 px further left.
inline void WriteImages(const TempFolder& folder, const SmallSequence& sequence, int index) {
  for (int camera = 0; camera < 2; ++camera) {
    const auto name = [&](int i) {
      return fmt::format("mav0/cam{}/data/{}.png", camera, ImageStamp(i));
    };
    if (sequence.still && index > 0) {
      std::filesystem::create_hard_link(folder.Path(name(0)), folder.Path(name(index)));
    } else {
      folder.Write(name(index), "");
      cv::imwrite(folder.Path(name(index)), Texture(index, 4 * camera, sequence.size));
    }
  }
}

// Writes mav0 under the folder: images in cam0 and cam1, and IMU samples around them.
inline void WriteSequence(const TempFolder& folder, const SmallSequence& sequence) {
  const std::string& end = sequence.line_end;
  std::string rows = "#timestamp [ns],filename" + end;
  std::string imu = "#timestamp [ns],wx,wy,wz,ax,ay,az" + end;
  for (int i = 0; i < sequence.images; ++i) {
    rows += fmt::format("{0},{0}.png{1}", ImageStamp(i), end);
    WriteImages(folder, sequence, i);
  }
  const int64_t last_ns = ImageStamp(sequence.images);
  for (int64_t t = kFirstStamp_ns - 4 * kImuStep_ns; t <= last_ns; t += kImuStep_ns) {
    imu += ImuRow(t) + end;
  }
  for (int camera = 0; camera < 2; ++camera) {
    folder.Write(fmt::format("mav0/cam{}/data.csv", camera), rows);
    folder.Write(fmt::format("mav0/cam{}/sensor.yaml", camera),
                 SensorYaml(-0.1 * camera, sequence.size));
  }
  folder.Write("mav0/imu0/data.csv", imu);
  folder.Write("mav0/imu0/sensor.yaml", kImuYaml);
}

}  // namespace slcmap::testing
