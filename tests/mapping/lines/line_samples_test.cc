#include "mapping/lines/line_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::LookingAtWall;
using testing::PaintedWall;

constexpr double kEdge_px = 40.3;

// Dark on the right of an upright edge at kEdge_px and `bright` on its left, seen through a lens
// and clipped to 8 bits.
cv::Mat BlurredStep(double bright) {
  constexpr double kDark = 60, kBlur_px = 0.7;
  cv::Mat image(60, 80, CV_8UC1);
  for (int u = 0; u < image.cols; ++u) {
    const double share = 0.5 * std::erfc((u - kEdge_px) / (kBlur_px * std::sqrt(2.0)));
    const double grey = kDark + share * (bright - kDark);
    image.col(u).setTo(std::clamp(std::round(grey), 0.0, 255.0));
  }
  return image;
}

// Where samples along a line that is expected half a pixel beside the edge find it, on average.
double MeanEdge_px(const cv::Mat& image) {
  const cv::Mat mask(image.size(), CV_8UC1, 255);
  // Upwards, so that the bright side is on the left.
  const LineInView line{{{kEdge_px + 0.5, 50}, {kEdge_px + 0.5, 10}}, 0, 1, 2, 2};
  double sum = 0, count = 0;
  for (const LineSample& sample : SampleLine(image, mask, line, LineSampling())) {
    if (!sample.is_edge) continue;
    const Eigen::Vector2d normal(-1, 0);  // to the left
    sum += (sample.px + sample.across_px * normal).x();
    ++count;
  }
  EXPECT_GT(count, 5);
  return sum / count;
}

// Beside a window it is saturated: one shift for all leaves some of it; unshifted they are off by
// up to 0.8 px.
TEST(LineSamples, FindAnEdgeBelowThePixel) {
  for (const auto& [bright, off_px] :
       {std::pair(200, 0.08), std::pair(450, 0.4), std::pair(600, 0.4), std::pair(800, 0.4)}) {
    EXPECT_NEAR(MeanEdge_px(BlurredStep(bright)), kEdge_px, off_px) << bright;
  }
}

// A screen of 1 m x 1 m at 2 m, in points every 4 cm that face the camera.
std::vector<DensePoint> DenseScreen(double normal_y = -1) {
  std::vector<DensePoint> points;
  for (int x = -12; x <= 12; ++x) {
    for (int z = -12; z <= 12; ++z) {
      points.push_back({{0.04 * x, 2, 0.04 * z}, {0, normal_y, 0}, 0, 0});
    }
  }
  return points;
}

ViewCameras OneView() {
  const Views views = {LookingAtWall({0, 0, 0}, 100)};
  return ViewCameras(views, PaintedWall(views).rig());
}

const Eigen::Vector2d kMiddle_px(239.5, 159.5);

TEST(VisibilityDepths, ASurfaceHidesWhatIsBehindIt) {
  const VisibilityDepths depths(DenseScreen(), 0.04, OneView());
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px, 3));
  EXPECT_TRUE(depths.Hides(0, 1, kMiddle_px, 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 2.05)) << "a line on it";
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 1)) << "before it";
  // Its border is 75 px from the middle.
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(60, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(90, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, {-5, 20}, 3)) << "outside the image";
}

TEST(VisibilityDepths, BacksAndUnknownSurfacesHideNothing) {
  EXPECT_FALSE(VisibilityDepths(DenseScreen(1), 0.04, OneView()).Hides(0, 0, kMiddle_px, 3));
  EXPECT_FALSE(VisibilityDepths().Hides(0, 0, kMiddle_px, 3));
  const Progress stop([](double) { return false; });
  EXPECT_FALSE(VisibilityDepths(DenseScreen(), 0.04, OneView(), stop).Hides(0, 0, kMiddle_px, 3));
}

}  // namespace
}  // namespace slcmap
