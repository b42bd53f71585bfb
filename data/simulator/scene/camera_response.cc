#include "data/simulator/scene/camera_response.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/core/error.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {
namespace {

constexpr int kNormalCount = 1 << 16;
constexpr int kSignalSteps = 16;  // of signal per grey value

cv::Mat Transmission(double vignetting, int width_px, int height_px) {
  cv::Mat image(height_px, width_px, CV_32F);
  const double cx = 0.5 * (width_px - 1), cy = 0.5 * (height_px - 1);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy);
      image.at<float>(y, x) = static_cast<float>(1 - vignetting * r2);
    }
  }
  return image;
}

std::vector<float> NormalNumbers() {
  std::mt19937 generator(1);
  std::normal_distribution<float> normal;
  std::vector<float> numbers(kNormalCount);
  for (float& n : numbers) n = normal(generator);
  return numbers;
}

std::vector<uint8_t> GreyTable(double gamma) {
  std::vector<uint8_t> table(256 * kSignalSteps);
  for (size_t i = 0; i < table.size(); ++i) {
    const double signal = static_cast<double>(i) / kSignalSteps;
    const double grey = 255 * std::pow(signal / 255, 1 / gamma);
    table[i] = static_cast<uint8_t>(std::clamp(std::lround(grey), 0l, 255l));
  }
  return table;
}

constexpr OptionTable kCamera{
    Option{"exposure_ms", &CameraResponseOptions::exposure_ms, 0.0, 1000.0},
    Option{"min_exposure_ms", &CameraResponseOptions::min_exposure_ms, 1e-6, 1000.0},
    Option{"max_exposure_ms", &CameraResponseOptions::max_exposure_ms, 1e-6, 1000.0},
    Option{"max_gain", &CameraResponseOptions::max_gain, 1.0, 1000.0},
    Option{"target_grey", &CameraResponseOptions::target_grey, 1.0, 254.0},
    Option{"adaption_s", &CameraResponseOptions::adaption_s, 1e-6, 1000.0},
    Option{"sensitivity", &CameraResponseOptions::sensitivity, 1e-6, 1e9},
    Option{"lens_blur_px", &CameraResponseOptions::lens_blur_px, 0.0, 9.9},
    Option{"vignetting", &CameraResponseOptions::vignetting, 0.0, 0.99},
    Option{"full_well_electrons", &CameraResponseOptions::full_well_electrons, 1.0, 1e9},
    Option{"read_noise_grey", &CameraResponseOptions::read_noise_grey, 0.0, 255.0},
    Option{"gamma", &CameraResponseOptions::gamma, 0.1, 10.0}};

}  // namespace

void CameraResponseOptions::Check() const {
  kCamera.Check("camera", *this);
  if (max_exposure_ms < min_exposure_ms) {
    throw ConfigError("camera.max_exposure_ms: expected at least min_exposure_ms");
  }
}

void CameraResponseOptions::Read(YamlSection section) { kCamera.Read(section, this); }

std::vector<Exposure> PlanExposures(const std::vector<double>& times_s,
                                    const std::vector<double>& mean_radiance,
                                    const CameraResponseOptions& options) {
  std::vector<Exposure> exposures;
  double log_product = 0;  // of exposure time and gain
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double wanted =
        std::log(options.target_grey / options.sensitivity / std::max(mean_radiance[i], 1e-6));
    const double keep = i == 0 ? 0 : std::exp(-(times_s[i] - times_s[i - 1]) / options.adaption_s);
    log_product = keep * log_product + (1 - keep) * wanted;
    const double product_ms = std::exp(log_product);
    Exposure exposure;
    exposure.time_ms = options.exposure_ms > 0 ? options.exposure_ms
                                               : std::clamp(product_ms, options.min_exposure_ms,
                                                            options.max_exposure_ms);
    exposure.gain = std::clamp(product_ms / exposure.time_ms, 1.0, options.max_gain);
    exposures.push_back(exposure);
  }
  return exposures;
}

CameraResponse::CameraResponse(const CameraResponseOptions& options, int width_px, int height_px)
    : options_(options),
      transmission_(Transmission(options.vignetting, width_px, height_px)),
      normal_(NormalNumbers()),
      grey_of_signal_(GreyTable(options.gamma)) {
  options.Check();
}

cv::Mat CameraResponse::Develop(const cv::Mat& radiance, const Exposure& exposure, int frame,
                                int camera) const {
  cv::Mat blurred = radiance;
  if (options_.lens_blur_px > 0) {
    cv::GaussianBlur(radiance, blurred, {}, options_.lens_blur_px, 0, cv::BORDER_REPLICATE);
  }
  cv::Mat image(radiance.size(), CV_8U);
  const float scale = static_cast<float>(options_.sensitivity * exposure.time_ms * exposure.gain);
  const float on = options_.with_noise ? 1 : 0;
  // Variance of a signal in grey values: that of its electrons, and that of reading it.
  const float shot = on * static_cast<float>(255 * exposure.gain / options_.full_well_electrons);
  const float read = on * static_cast<float>(std::pow(options_.read_noise_grey * exposure.gain, 2));
  const uint32_t seed = Mixed(options_.seed, static_cast<uint32_t>(2 * frame + camera));
  const float last = static_cast<float>(grey_of_signal_.size() - 1);
  uint32_t pixel = 0;
  for (int y = 0; y < image.rows; ++y) {
    const float* in = blurred.ptr<float>(y);
    const float* transmission = transmission_.ptr<float>(y);
    uint8_t* out = image.ptr<uint8_t>(y);
    for (int x = 0; x < image.cols; ++x, ++pixel) {
      const float signal = scale * in[x] * transmission[x];
      const float normal = normal_[Mixed(seed + pixel) & (kNormalCount - 1)];
      const float noisy = signal + std::sqrt(shot * signal + read) * normal;
      out[x] =
          grey_of_signal_[static_cast<int>(std::clamp(noisy * kSignalSteps + 0.5f, 0.0f, last))];
    }
  }
  return image;
}

}  // namespace slcmap::data
