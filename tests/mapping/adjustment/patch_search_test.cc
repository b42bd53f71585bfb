#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "mapping/views/view_matches.h"

namespace slcmap {
namespace {

using Eigen::Vector2f;

// Smooth noise, the same at each call.
cv::Mat Texture() {
  cv::Mat noise(200, 300, CV_8UC1), smooth;
  cv::RNG generator(1);
  generator.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, smooth, {0, 0}, 2);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  return smooth;
}

cv::Mat Moved(const cv::Mat& image, const Eigen::Matrix2f& affine, const Vector2f& shift) {
  const cv::Matx23f map(affine(0, 0), affine(0, 1), shift.x(), affine(1, 0), affine(1, 1),
                        shift.y());
  cv::Mat out;
  cv::warpAffine(image, out, map, image.size());
  return out;
}

TEST(PatchSearch, FindsAPlaceBelowThePixel) {
  const cv::Mat from = Texture();
  Eigen::Matrix2f affine;
  affine << 1.1f, -0.05f, 0.05f, 1.1f;
  const Vector2f shift(3.3f, -6.6f), at(150, 100), truth = affine * at + shift;
  const cv::Mat to = Moved(from, affine, shift);
  const PatchWarp expected{truth + Vector2f(7, -5), affine};
  const auto places = SearchPatch(from, at, to, expected, 12, {});
  ASSERT_FALSE(places.empty());
  EXPECT_LT((places[0] - truth).norm(), 0.1f);
  EXPECT_TRUE(SearchPatch(from, at, to, {truth + Vector2f(30, 0), affine}, 12, {}).empty());
}

TEST(PatchSearch, ARepeatedPatternHasSeveralPlaces) {
  cv::Mat from(200, 300, CV_8UC1, cv::Scalar(40));
  for (int x = 0; x < 300; x += 20) {
    for (int y = 0; y < 200; y += 20) {
      cv::rectangle(from, {x, y, 10, 10}, cv::Scalar(200), cv::FILLED);
    }
  }
  cv::GaussianBlur(from, from, {0, 0}, 1);
  const auto places =
      SearchPatch(from, {140, 100}, from, {{140, 100}, Eigen::Matrix2f::Identity()}, 25, {});
  EXPECT_EQ(places.size(), 3u);
}

TEST(PatchSearch, NothingIsFoundWithoutTextureOrBeyondTheBorder) {
  const cv::Mat texture = Texture(), grey(200, 300, CV_8UC1, cv::Scalar(90));
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  EXPECT_TRUE(SearchPatch(grey, {150, 100}, texture, {{150, 100}, same}, 10, {}).empty());
  EXPECT_TRUE(SearchPatch(texture, {2, 100}, texture, {{150, 100}, same}, 10, {}).empty());
  EXPECT_TRUE(SearchPatch(texture, {150, 100}, texture, {{295, 100}, same}, 10, {}).empty());
}

}  // namespace
}  // namespace slcmap
