#include "odometry/frontend/point_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <tuple>

#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

const Eigen::Quaterniond kNoRotation = Eigen::Quaterniond::Identity();

Rig TestRig() {
  Rig rig;
  rig.cameras.assign(2, testing::PinholeCamera(640, 480, 400, 319.5, 239.5));
  rig.T_imu_camera[1].translation = {0.1, 0, 0};
  return rig;
}

// A smooth picture with detail at several scales.
class Scene {
 public:
  cv::Mat Shifted(double x_px, double y_px) const {
    cv::Mat image(480, 640, CV_8UC1);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        const Eigen::Vector2d p(u - 320 - x_px, v - 240 - y_px);
        image.at<uchar>(v, u) = cv::saturate_cast<uchar>(Brightness(p));
      }
    }
    return image;
  }

 private:
  // Sums of sines of periods of 9 to 80 px: band-limited, so that any sub-pixel shift is exact.
  static double Brightness(const Eigen::Vector2d& p) {
    static constexpr double kWaves[][3] = {
        {80, 0.3, 0.5}, {60, 1.2, 1.5}, {41, 2.3, 4.0}, {33, 2.9, 2.2},   {27, 0.7, 0.1},
        {19, 1.8, 3.3}, {15, 2.6, 1.1}, {12, 0.1, 5.0}, {10.5, 1.4, 2.7}, {9, 2.05, 0.4}};
    double sum = 0;
    for (const auto& [period, angle, phase] : kWaves) {
      sum +=
          std::sin(2 * M_PI / period * (p.x() * std::cos(angle) + p.y() * std::sin(angle)) + phase);
    }
    return 120 + 11 * sum;
  }
};

class PointTrackerTest : public ::testing::Test {
 protected:
  PointTracker tracker_{PointTrackerOptions(), TestRig(), cv::Mat(480, 640, CV_8UC1, 255)};
  Scene scene_;
};

std::map<int64_t, Eigen::Vector2d> LeftPixels(const PointTracker& tracker) {
  std::map<int64_t, Eigen::Vector2d> pixels;
  for (const auto& p : tracker.observations()) pixels[p.id] = p.left_px;
  return pixels;
}

// The RMS distance of the tracked points from where `truth` moves their first pixels.
template <typename Truth>
double RmsError_px(const std::map<int64_t, Eigen::Vector2d>& first, const PointTracker& tracker,
                   Truth truth) {
  double sum = 0;
  for (const auto& p : tracker.observations()) {
    sum += (p.left_px - truth(first.at(p.id))).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(tracker.observations().size()));
}

TEST_F(PointTrackerTest, FollowsASubPixelShiftOverManyFrames) {
  tracker_.Track(scene_.Shifted(0, 0), kNoRotation);
  tracker_.Detect({});
  const auto first = LeftPixels(tracker_);
  ASSERT_GT(first.size(), 100u);
  for (int i = 1; i <= 12; ++i) {
    tracker_.Track(scene_.Shifted(1.37 * i, -0.81 * i), kNoRotation);
  }
  EXPECT_GT(tracker_.observations().size(), first.size() * 8 / 10);
  EXPECT_LT(RmsError_px(first, tracker_,
                        [](const Eigen::Vector2d& p) -> Eigen::Vector2d {
                          return p + 12 * Eigen::Vector2d(1.37, -0.81);
                        }),
            0.03);
}

// Lamps on a dark wall, each pixel averaged, so much nearer than at first.
cv::Mat Lamps(double nearer) {
  constexpr int kSamples = 3;
  cv::Mat image(480, 640, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      int lit = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const double x = (u - 320.3 - 0.5 + (i % kSamples + 0.5) / kSamples) / nearer;
        const double y = (v - 240.4 - 0.5 + (i / kSamples + 0.5) / kSamples) / nearer;
        lit += std::abs(std::remainder(x, 60)) < 5 && std::abs(std::remainder(y, 50)) < 4 &&
               std::abs(x) < 160 && std::abs(y) < 120;
      }
      image.at<uchar>(v, u) = static_cast<uchar>(40 + 160 * lit / (kSamples * kSamples));
    }
  }
  return image;
}

// However different a thing looks from near: its points are where they were, or lost.
TEST_F(PointTrackerTest, APointDoesNotSlideAlongAThingThatComesNearer) {
  tracker_.Track(Lamps(1), kNoRotation);
  tracker_.Detect(cv::Mat());
  const auto first = LeftPixels(tracker_);
  ASSERT_GE(first.size(), 20u);
  const Eigen::Vector2d middle(320.3, 240.4);
  for (double nearer = 1.05; nearer < 2.8; nearer *= 1.05) {
    tracker_.Track(Lamps(nearer), kNoRotation);
    const auto truth = [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
      return middle + nearer * (px - middle);
    };
    if (!tracker_.observations().empty()) {
      EXPECT_LT(RmsError_px(first, tracker_, truth), 0.8) << nearer;
    }
    if (nearer < 1.4) {
      EXPECT_GT(tracker_.observations().size(), first.size() / 2) << nearer;
    }
  }
}

// The RMS of how far disparities are from one; most points have to have one.
double DisparityError_px(const PointTracker& tracker, double disparity_px) {
  int seen = 0;
  double sum = 0;
  for (const auto& p : tracker.observations()) {
    if (!p.right_px) continue;
    sum += (p.left_px - *p.right_px - Eigen::Vector2d(disparity_px, 0)).squaredNorm();
    ++seen;
  }
  EXPECT_GT(seen, 0.8 * static_cast<double>(tracker.observations().size()));
  return std::sqrt(sum / seen);
}

TEST_F(PointTrackerTest, FindsTheDisparityAndFollowsItOverFramesThatLookedLeftOnly) {
  tracker_.Track(scene_.Shifted(0, 0), kNoRotation);
  tracker_.Detect(scene_.Shifted(-7.3, 0));
  EXPECT_LT(DisparityError_px(tracker_, 7.3), 0.03);
  for (int i = 1; i <= 5; ++i) {
    tracker_.Track(scene_.Shifted(2 * i, 0), kNoRotation);
    for (const auto& p : tracker_.observations()) EXPECT_FALSE(p.right_px);
  }
  tracker_.Detect(scene_.Shifted(10 - 9.1, 0));
  EXPECT_LT(DisparityError_px(tracker_, 9.1), 0.1);
}

TEST_F(PointTrackerTest, RejectsNegativeDisparityAndOtherRows) {
  tracker_.Track(scene_.Shifted(0, 0), kNoRotation);
  tracker_.Detect(scene_.Shifted(7.3, 0));
  ASSERT_GT(tracker_.observations().size(), 100u);
  for (const auto& p : tracker_.observations()) EXPECT_FALSE(p.right_px);
  tracker_.Detect(scene_.Shifted(-7.3, 3));
  for (const auto& p : tracker_.observations()) {
    // What looks alike by chance elsewhere along the row cannot be told.
    if (p.right_px) {
      EXPECT_GT(std::abs(p.left_px.x() - p.right_px->x() - 7.3), 1);
    }
  }
}

TEST_F(PointTrackerTest, IdsAreNeverReused) {
  std::set<int64_t> seen;
  const cv::Mat image = scene_.Shifted(0, 0);
  for (int i = 0; i < 4; ++i) {
    tracker_.Track(image, kNoRotation);
    tracker_.Detect({});
    for (const auto& p : tracker_.observations()) EXPECT_TRUE(seen.insert(p.id).second);
    if (i % 2 == 0) {
      tracker_.Reset();
    } else {
      tracker_.Remove({seen.begin(), seen.end()});
    }
    EXPECT_TRUE(tracker_.observations().empty());
  }
}

TEST_F(PointTrackerTest, SurvivesBlackAndGrayImages) {
  const cv::Mat left = scene_.Shifted(0, 0), right = scene_.Shifted(-5, 0);
  for (const int value : {0, 128, 255}) {
    tracker_.Track(left, kNoRotation);
    tracker_.Detect(right);
    EXPECT_GT(tracker_.observations().size(), 100u);
    const cv::Mat flat(480, 640, CV_8UC1, cv::Scalar(value));
    tracker_.Track(flat, kNoRotation);
    tracker_.Detect(flat);
    EXPECT_TRUE(tracker_.observations().empty());
  }
}

TEST_F(PointTrackerTest, KeepsTheDistanceAndTheMaximum) {
  PointTrackerOptions options;
  options.max_points = 40;
  options.min_distance_px = 35;
  cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 200, 480)) = 0;
  PointTracker tracker(options, TestRig(), mask);
  for (int i = 0; i < 5; ++i) {
    tracker.Track(scene_.Shifted(4 * i, 0), kNoRotation);
    tracker.Detect({});
  }
  const auto& points = tracker.observations();
  EXPECT_LE(points.size(), 40u);
  EXPECT_GE(points.size(), 37u);
  for (const auto& a : points) {
    EXPECT_GE(a.left_px.x(), 199);
    for (const auto& b : points) {
      if (a.id == b.id) continue;
      EXPECT_GT((a.left_px - b.left_px).norm(), 30);
    }
  }
}

cv::Point Pixel(const Eigen::Vector2d& px) {
  return {static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y()))};
}

// Bright squares of `side_px`: the edges about each corner meet in it, wherever it was detected.
cv::Mat Squares(int side_px) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(60));
  for (int v = 30; v < 440; v += 40) {
    for (int u = 30; u < 600; u += 40) {
      cv::rectangle(image, cv::Rect(u, v, side_px, side_px), cv::Scalar(180), cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 1);
  return image;
}

// Corners are moved to where edges meet: not onto each other, nor to where the mask says no.
TEST_F(PointTrackerTest, PointsThatAreMovedKeepTheirDistanceAndTheMask) {
  PointTrackerOptions options;
  options.min_distance_px = 5;
  options.max_points = 2000;
  for (int side_px = 3; side_px <= 9; ++side_px) {
    const cv::Mat image = Squares(side_px);
    PointTracker free(options, TestRig(), cv::Mat(480, 640, CV_8UC1, 255));
    free.Track(image, kNoRotation);
    free.Detect({});
    ASSERT_GT(free.observations().size(), 100u);
    // Corners may be found all about where they are moved to.
    cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(255));
    for (const auto& [id, px] : LeftPixels(free)) mask.at<uchar>(Pixel(px)) = 0;
    PointTracker masked(options, TestRig(), mask);
    masked.Track(image, kNoRotation);
    masked.Detect({});
    for (const auto& [id, px] : LeftPixels(masked)) EXPECT_TRUE(mask.at<uchar>(Pixel(px)));
    for (const auto& a : free.observations()) {
      for (const auto& b : free.observations()) {
        if (a.id < b.id) {
          EXPECT_GT((a.left_px - b.left_px).norm(), 2.49) << side_px;
        }
      }
    }
  }
}

TEST_F(PointTrackerTest, IsTheSameWhateverTheThreads) {
  std::vector<cv::Mat> lefts, rights;
  for (int i = 0; i < 4; ++i) {
    lefts.push_back(scene_.Shifted(2.3 * i, i));
    rights.push_back(scene_.Shifted(2.3 * i - 6, i));
  }
  const auto run = [&](int threads) {
    cv::setNumThreads(threads);
    PointTracker tracker(PointTrackerOptions(), TestRig(), cv::Mat(480, 640, CV_8UC1, 255));
    for (size_t i = 0; i < lefts.size(); ++i) {
      tracker.Track(lefts[i], kNoRotation);
      tracker.Detect(rights[i]);
    }
    return tracker.observations();
  };
  const auto one = run(1), two = run(2);
  cv::setNumThreads(-1);
  EXPECT_TRUE(std::ranges::equal(one, two, [](const auto& a, const auto& b) {
    return std::tie(a.id, a.left_px, a.right_px) == std::tie(b.id, b.left_px, b.right_px);
  }));
}

}  // namespace
}  // namespace slcmap
