#include "data/simulator/scene/camera_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <string>

#include "data/core/error.h"
#include "data/simulator/scene/scene.h"

namespace slcmap {
namespace {

TEST(CameraResponseTest, AutomaticExposureFollowsSlowlyAndKeepsItsLimits) {
  CameraResponseOptions options;
  std::vector<double> times_s, radiance;
  for (int i = 0; i < 120; ++i) {
    times_s.push_back(0.05 * i);
    radiance.push_back(i < 40 ? 0.2 : i < 80 ? 0.01 : 100);
  }
  const std::vector<Exposure> exposures = PlanExposures(times_s, radiance, options);
  EXPECT_NEAR(exposures[0].time_ms * 0.2 * options.sensitivity, options.target_grey, 1e-6);
  EXPECT_EQ(exposures[0].gain, 1);
  EXPECT_GT(exposures[41].time_ms, exposures[40].time_ms);
  EXPECT_LT(exposures[40].time_ms, 3 * exposures[39].time_ms + 1e-9);
  EXPECT_EQ(exposures[79].time_ms, options.max_exposure_ms);
  EXPECT_EQ(exposures[79].gain, options.max_gain);
  EXPECT_EQ(exposures[119].time_ms, options.min_exposure_ms);
  EXPECT_EQ(exposures[119].gain, 1);
}

TEST(CameraResponseTest, SaturatesAndDarkensTheCorners) {
  CameraResponseOptions options;
  options.with_noise = false;
  const CameraResponse response(options, 64, 48);
  cv::Mat radiance(48, 64, CV_32F, cv::Scalar(100 / options.sensitivity));
  radiance.at<float>(24, 32) = 50;
  const cv::Mat image = response.Develop(radiance, {1, 1}, 0, 0);
  EXPECT_EQ(image.at<uint8_t>(24, 32), 255);
  EXPECT_NEAR(image.at<uint8_t>(24, 30), 100, 1);
  EXPECT_NEAR(image.at<uint8_t>(0, 0), 100 * (1 - options.vignetting), 1);
}

TEST(CameraResponseTest, NoiseGrowsAsTheRootOfTheSignal) {
  CameraResponseOptions options;
  options.vignetting = 0;
  options.read_noise_grey = 0;
  const CameraResponse response(options, 200, 200);
  for (const double grey : {40.0, 160.0}) {
    const cv::Mat radiance(200, 200, CV_32F, cv::Scalar(grey / options.sensitivity));
    cv::Scalar mean, sigma;
    cv::meanStdDev(response.Develop(radiance, {1, 1}, 3, 1), mean, sigma);
    const double variance = 255 / options.full_well_electrons * grey + 1.0 / 12;  // and rounding
    EXPECT_NEAR(mean[0], grey, 0.1);
    EXPECT_NEAR(sigma[0], std::sqrt(variance), 0.03 * sigma[0]);
  }
}

// The standard deviation over an image of one brightness, in shares of full scale.
double NoiseAt(double share, const CameraResponseOptions& options) {
  const CameraResponse response(options, 200, 200);
  const cv::Mat radiance(200, 200, CV_32F, cv::Scalar(255 * share / options.sensitivity));
  cv::Scalar mean, sigma;
  cv::meanStdDev(response.Develop(radiance, {1, 1}, 3, 1), mean, sigma);
  EXPECT_NEAR(mean[0] / 255, share, 1e-3);
  return sigma[0] / 255;
}

TEST(CameraResponseTest, LowTextureScenesHaveTheNoiseThatTheySay) {
  for (const char* scene : {"lowtexture_corridor.yaml", "lowtexture_office.yaml"}) {
    CameraResponseOptions options =
        ReadSceneCamera(std::string(SLCMAP_SOURCE_DIR "/config/scenes/") + scene);
    EXPECT_EQ(options.max_gain, 1) << scene;  // so that the noise is the same in the dark
    options.vignetting = 0;
    for (const double share : {0.1, 0.4, 0.8}) {
      EXPECT_NEAR(NoiseAt(share, options), std::sqrt(0.006 * 0.006 + 0.00035 * share), 3e-4);
    }
  }
}

TEST(CameraResponseTest, RejectsAbsurdOptions) {
  CameraResponseOptions options;
  options.max_exposure_ms = 0.1;
  EXPECT_THROW(options.Check(), ConfigError);
}

}  // namespace
}  // namespace slcmap
