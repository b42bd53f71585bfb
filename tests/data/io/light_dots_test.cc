#include "data/io/light_dots.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "data/io/image.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using testing::TempFolder;

constexpr int kDotsWidth_px = 640, kDotsHeight_px = 400;

// A smooth picture that is another one with every seed.
cv::Mat SmoothScene(int seed) {
  cv::Mat noise(6, 9, CV_8UC1), scene;
  cv::RNG random(static_cast<uint64_t>(seed) + 1);
  random.fill(noise, cv::RNG::UNIFORM, 30, 150);
  cv::resize(noise, scene, cv::Size(kDotsWidth_px, kDotsHeight_px), 0, 0, cv::INTER_CUBIC);
  return scene;
}

// Adds spots at places that the pattern has, moved along the rows by as much as each part of the
// picture is near.
void AddSpots(uint64_t pattern, int scene, cv::Mat* image) {
  cv::RNG places(pattern);
  for (int i = 0; i < 3000; ++i) {
    const double x = places.uniform(0.0, 1.0) * kDotsWidth_px;
    const double y = places.uniform(0.0, 1.0) * kDotsHeight_px;
    const int part = static_cast<int>(x / 160) + 4 * static_cast<int>(y / 200);
    const double moved = (part * 7 + scene * 5) % 12;
    for (int row = -2; row <= 2; ++row) {
      for (int column = -2; column <= 2; ++column) {
        const int u = static_cast<int>(x + moved) + column, v = static_cast<int>(y) + row;
        if (u < 0 || v < 0 || u >= image->cols || v >= image->rows) continue;
        const double bright = 60 * std::exp(-0.5 * (row * row + column * column) / 0.8);
        image->at<uchar>(v, u) = cv::saturate_cast<uchar>(image->at<uchar>(v, u) + bright);
      }
    }
  }
}

cv::Mat LitScene(int scene, uint64_t pattern) {
  cv::Mat image = SmoothScene(scene);
  AddSpots(pattern, scene, &image);
  return image;
}

TEST(LightDots, AreToldByWhatMovesWithTheCamera) {
  std::vector<cv::Mat> lit, textured, plain, still;
  for (int i = 0; i < 4; ++i) {
    lit.push_back(LitScene(i, 7));
    textured.push_back(LitScene(i, static_cast<uint64_t>(100 + i)));  // spots of the scene
    plain.push_back(SmoothScene(i));
    still.push_back(LitScene(0, 7));
  }
  EXPECT_TRUE(ShowSameDots(lit));
  EXPECT_FALSE(ShowSameDots(textured));
  EXPECT_FALSE(ShowSameDots(plain));
  EXPECT_FALSE(ShowSameDots(still));
}

TEST(LightDots, AreTakenOutOfImages) {
  const cv::Mat dark = SmoothScene(3), without = WithoutDots(LitScene(3, 7));
  cv::Mat off;
  cv::absdiff(dark, without, off);
  EXPECT_LT(cv::mean(off)[0], 2);
  EXPECT_GT(DotLevel(LitScene(3, 7)), 5 * DotLevel(dark) + 0.01);
}

std::vector<std::string> WriteImages(const TempFolder& folder, const std::vector<cv::Mat>& images) {
  std::vector<std::string> paths;
  for (size_t i = 0; i < images.size(); ++i) {
    paths.push_back(folder.Path("image" + std::to_string(i) + ".png"));
    WritePng(paths.back(), images[i]);
  }
  return paths;
}

TEST(FindLitImages, FindsTheHalfThatAnEmitterLights) {
  std::vector<cv::Mat> images;
  std::vector<size_t> lit;
  for (int i = 0; i < 30; ++i) {
    if (i == 13) continue;  // a lost one
    if (i % 2 == 0) lit.push_back(images.size());
    images.push_back(i % 2 == 0 ? LitScene(i / 8, 7) : SmoothScene(i / 8));
  }
  const TempFolder folder;
  EXPECT_EQ(FindLitImages(*FileImages(), WriteImages(folder, images)), lit);
  const std::vector<cv::Mat> steady(20, LitScene(1, 7));
  EXPECT_TRUE(FindLitImages(*FileImages(), WriteImages(folder, steady)).empty());
}

}  // namespace
}  // namespace slcmap
