#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>

#include "odometry/frontend/line_segment.h"

namespace slcmap {
namespace {

constexpr double kBlur_px = 1, kSlope = 3, kStep = 10;

// Brightness at a distance from an edge: a step, and a slope behind it, blurred.
double Brightness(double distance_px, double step, double slope) {
  const double u = distance_px / kBlur_px;
  const double share = 0.5 * std::erfc(-u / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  return 100 + step * share + slope * (distance_px * share + kBlur_px * density);
}

std::vector<EdgeProfile> Profiles(const std::function<double(double)>& brightness, int count,
                                  double noise) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, noise);
  std::vector<EdgeProfile> profiles(static_cast<size_t>(count));
  for (EdgeProfile& profile : profiles) {
    for (int i = -kEdgeReach; i <= kEdgeReach; ++i) {
      profile[static_cast<size_t>(i + kEdgeReach)] =
          brightness(i) + (noise > 0 ? normal(generator) : 0);
    }
  }
  return profiles;
}

TEST(EdgeShading, FindsHowFarASlopeMovesTheSteepestPlace) {
  // Of differences over two pixels, which blur by a third more.
  constexpr double kShift_px = kSlope * (kBlur_px * kBlur_px + 1.0 / 3) / kStep;
  const auto as_found = [](double x) { return Brightness(x + kShift_px, kStep, kSlope); };
  EXPECT_NEAR(ShadingShift_px(Profiles(as_found, 20, 0)), kShift_px, 0.3 * kShift_px);
  EXPECT_NEAR(ShadingShift_px(Profiles(as_found, 40, 0.5)), kShift_px, 0.5 * kShift_px);
  const auto mirrored = [](double x) { return -Brightness(kShift_px - x, kStep, kSlope); };
  EXPECT_NEAR(ShadingShift_px(Profiles(mirrored, 20, 0)), -kShift_px, 0.3 * kShift_px);
}

TEST(EdgeShading, IsZeroWhereNothingTellsOfASlope) {
  const auto step = [](double x) { return Brightness(x, kStep, 0); };
  EXPECT_NEAR(ShadingShift_px(Profiles(step, 20, 0)), 0, 0.01);
  EXPECT_NEAR(ShadingShift_px(Profiles(step, 20, 2)), 0, 0.1) << "noise";
  const auto neighbour = [](double x) {
    return Brightness(x, kStep, 0) + 40 / (1 + std::exp(-4 * (x - 3.5)));
  };
  EXPECT_NEAR(ShadingShift_px(Profiles(neighbour, 20, 0)), 0, 0.2) << "another edge";
  const auto flat = [](double) { return 7.0; };
  EXPECT_EQ(ShadingShift_px(Profiles(flat, 20, 0)), 0);
  EXPECT_EQ(ShadingShift_px({}), 0);
}

// An edge through the image whose slope grows along it, as that of one that recedes.
TEST(EdgeShading, RefinedSegmentsLieOnTheEdgeBesideFadingLight) {
  constexpr double kY_px = 60.3, kTilt = 0.04;
  cv::Mat image(120, 300, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double distance_px = (v - kY_px - kTilt * (u - 150)) / std::hypot(1, kTilt);
      const double value = Brightness(distance_px, kStep, 0.5 + 2 * u / 300.0) - 40;
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(value);
    }
  }
  LineSegment edge{{20, kY_px - kTilt * 130}, {280, kY_px + kTilt * 130}};
  if (MeanContrast(image, edge) < 0) edge = Reversed(edge);
  const auto refined = RefineSegment(image, edge, {});
  ASSERT_TRUE(refined);
  EXPECT_LT(LargestDistance_px(edge, refined->segment), 0.1);  // 0.25 with the steepest places
}

}  // namespace
}  // namespace slcmap
