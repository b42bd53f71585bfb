#include "odometry/frontend/line_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>
#include <set>

#include "odometry/frontend/line_segment.h"
#include "tests/odometry/frontend/line_test_scene.h"

namespace slcmap {
namespace {

using testing::DrawBars;
using testing::EdgesOf;
using testing::NearestEdge;
using testing::TestBars;

class LineDetectorTest : public ::testing::TestWithParam<LineDetectorKind> {
 protected:
  static std::vector<LineSegment> Detect(const cv::Mat& image, const cv::Mat& mask = {}) {
    LineDetectorOptions options;
    options.kind = GetParam();
    return DetectSegments(image, mask, options);
  }
};

TEST_P(LineDetectorTest, FindsEachEdgeOnceToATenthOfAPixel) {
  const cv::Mat image = DrawBars(TestBars());
  std::set<int> seen;
  for (const auto& s : Detect(image)) {
    const auto [edge, distance] = NearestEdge(EdgesOf(TestBars()), s);
    EXPECT_LT(distance, 0.15);
    EXPECT_TRUE(seen.insert(edge).second) << "edge " << edge << " twice";
    EXPECT_GT(MeanContrast(image, s), 20) << "the bright side is on the left";
  }
  EXPECT_GE(seen.size(), 11u);
}

TEST_P(LineDetectorTest, LeavesOutWhatTheMaskHides) {
  cv::Mat mask(400, 600, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 300) = 0;
  const auto segments = Detect(DrawBars(TestBars()), mask);
  EXPECT_GE(segments.size(), 3u);
  for (const auto& s : segments) EXPECT_GT(std::min(s.start.x(), s.end.x()), 299);
}

// The longest edges are those that leave the image on both sides.
TEST_P(LineDetectorTest, CutsEdgesAtTheBorderOfTheMask) {
  cv::Mat image(400, 600, CV_8UC1, cv::Scalar(60));
  image.colRange(301, 600) = 160;
  cv::Mat mask(400, 600, CV_8UC1, cv::Scalar(0));
  mask(cv::Range(8, 392), cv::Range(8, 592)) = 255;
  const auto segments = Detect(image, mask);
  ASSERT_EQ(segments.size(), 1u);
  EXPECT_GT(segments[0].Length(), 340);
  EXPECT_GE(std::min(segments[0].start.y(), segments[0].end.y()), 7.5);
  EXPECT_LE(std::max(segments[0].start.y(), segments[0].end.y()), 391.5);
}

TEST_P(LineDetectorTest, FindsNothingInAFlatImage) {
  EXPECT_TRUE(Detect(cv::Mat(400, 600, CV_8UC1, cv::Scalar(90))).empty());
}

INSTANTIATE_TEST_SUITE_P(Kinds, LineDetectorTest,
                         ::testing::Values(LineDetectorKind::kLsd, LineDetectorKind::kFld,
                                           LineDetectorKind::kEd));

// The size of the smaller image is rounded; the scale is not.
TEST(LineDetectorScaleTest, PlacesEdgesOfASmallerImageInTheWholeOne) {
  const cv::Mat image = DrawBars(TestBars())(cv::Rect(0, 0, 599, 399)).clone();
  for (const double scale : {1.0, 0.7, 0.5}) {
    LineDetectorOptions options;
    options.scale = scale;
    double length_px = 0;
    const auto segments = DetectSegments(image, {}, options);
    for (const auto& s : segments) {
      EXPECT_LT(NearestEdge(EdgesOf(TestBars()), s).second, 0.15) << "scale " << scale;
      length_px += s.Length();
    }
    EXPECT_GE(segments.size(), 11u) << "scale " << scale;
    EXPECT_GT(length_px / static_cast<double>(segments.size()), 150) << "scale " << scale;
    double raw_px = 0;
    for (const auto& s : DetectRawSegments(image, options, 60)) {
      raw_px = std::max(raw_px, NearestEdge(EdgesOf(TestBars()), s).second);
    }
    EXPECT_LT(raw_px, 0.9 / scale) << "scale " << scale;
  }
}

TEST(JoinSegmentsTest, JoinsPiecesOfOneEdgeAndNoOthers) {
  const std::vector<LineSegment> pieces = {{{10, 50}, {60, 50}},
                                           {{70, 50.3}, {120, 50.2}},  // goes on
                                           {{20, 54}, {100, 54}},      // beside it
                                           {{120, 50}, {10, 50}},      // of the other polarity
                                           {{300, 50}, {350, 50}},     // far along
                                           {{125, 50}, {160, 58}}};    // bent
  const auto joined = JoinSegments(pieces, 30);
  EXPECT_EQ(joined.size(), 5u);
  EXPECT_NEAR(joined.front().Length(), 110, 0.5);
}

TEST(RefineSegmentTest, PlacesATiltedGuessOnTheEdgeAndExtendsIt) {
  const auto bars = TestBars();
  const cv::Mat image = DrawBars(bars);
  LineSegment edge = EdgesOf(bars)[4];
  if (MeanContrast(image, edge) < 0) edge = Reversed(edge);
  const Eigen::Vector2d d = Direction(edge), n = Normal(edge);
  const LineSegment guess{edge.start + 60 * d + 1.5 * n, edge.end - 60 * d - 1.0 * n};
  LineRefinementOptions options;
  options.max_extension_px = 100;
  const auto refined = RefineSegment(image, guess, options);
  ASSERT_TRUE(refined);
  EXPECT_LT(LargestDistance_px(edge, refined->segment), 0.1);
  EXPECT_NEAR(refined->segment.Length(), edge.Length(), 10);
  EXPECT_FALSE(RefineSegment(image, Reversed(guess), options)) << "the other polarity";
  EXPECT_FALSE(RefineSegment(image, {guess.start + 30 * n, guess.end + 30 * n}, options));
}

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
