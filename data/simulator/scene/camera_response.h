// From radiance to grey values: exposure, vignetting, noise and 8 bits; and random numbers that
// depend on a counter only, not on who asked before.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/io/yaml.h"

namespace slcmap::inline data {

// Mixes all bits (the finaliser of MurmurHash3).
inline uint32_t Mixed(uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

inline uint32_t Mixed(uint32_t a, uint32_t b) { return Mixed(a + 0x9e3779b9u * (Mixed(b) + 1)); }

// Uniform in [0, 1).
inline float UnitFloat(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

// The variance of a signal I at gain g is g^2 read_noise_grey^2 + g 255 I / full_well_electrons,
// all in grey values: with shares of full scale instead, (g read_noise_grey / 255)^2 +
// g I / full_well_electrons.
struct CameraResponseOptions {
  double exposure_ms = 0;  // fixed; 0: automatic
  double min_exposure_ms = 0.2, max_exposure_ms = 15;
  double max_gain = 4;
  double target_grey = 110;            // what automatic exposure brings the mean to
  double adaption_s = 0.25;            // time constant of automatic exposure
  double sensitivity = 120;            // grey values per radiance and millisecond, at gain 1
  double lens_blur_px = 0.5;           // standard deviation of the lens' point spread
  double vignetting = 0.35;            // loss of light in the corners
  double full_well_electrons = 11000;  // at grey value 255 and gain 1
  double read_noise_grey = 0.6;        // standard deviation, at gain 1
  double gamma = 1;                    // grey = 255 (signal / 255)^(1 / gamma)
  bool with_noise = true;
  uint32_t seed = 1;
  void Check() const;  // throws ConfigError
  // The section `camera` of a scene; all of the above but with_noise and seed.
  void Read(YamlSection section);
};

struct Exposure {
  double time_ms = 1;
  double gain = 1;
};

// The exposures of a sequence as automatic exposure sets them, slowly, from the mean radiance that
// it saw until then.
std::vector<Exposure> PlanExposures(const std::vector<double>& times_s,
                                    const std::vector<double>& mean_radiance,
                                    const CameraResponseOptions& options);

class CameraResponse {
 public:
  CameraResponse(const CameraResponseOptions& options, int width_px, int height_px);

  // Radiance (float) to grey values (8 bit). The noise depends on frame, camera, pixel and seed.
  cv::Mat Develop(const cv::Mat& radiance, const Exposure& exposure, int frame, int camera) const;

 private:
  CameraResponseOptions options_;
  cv::Mat transmission_;                 // by pixel, 1 in the middle
  std::vector<float> normal_;            // standard normal numbers, to be picked at random
  std::vector<uint8_t> grey_of_signal_;  // of 16 steps a grey value
};

}  // namespace slcmap::data
