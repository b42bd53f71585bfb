#include "mapping/lines/line_sides.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

constexpr double kFront_m = 2;

// A speckled wall up to x = 0, and another, brighter one behind it or beside it from there on, seen
// along the world's y.
class SpeckledWalls : public ViewImages {
 public:
  SpeckledWalls(Views views, double left_m, double right_m)
      : views_(std::move(views)), left_m_(left_m), right_m_(right_m) {
    for (int i = 0; i < 2; ++i) {
      rig_.cameras[i] = testing::PinholeCamera(320, 240, kFocal_px, kCentre.x(), kCentre.y());
      rig_.T_imu_camera[i].translation.x() = 0.11 * i;
    }
    cv::RNG dice(7);
    dice.fill(speckles_, cv::RNG::NORMAL, 0, 60);
    cv::GaussianBlur(speckles_, speckles_, {0, 0}, 1.5);
  }

  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    return {views_[view].stamp_ns, Paint(view, 0), Paint(view, 1)};
  }

 private:
  static constexpr double kFocal_px = 250, kTexel_m = 0.008;
  static inline const Eigen::Vector2d kCentre{159.5, 119.5};

  // A wall's image, with the middle of the speckles at a place of it.
  cv::Mat Wall(const Eigen::Vector3d& camera, double wall_m, double x_m, double grey) const {
    const double px_a_m = kFocal_px / wall_m, px_a_texel = kTexel_m * px_a_m;
    const Eigen::Vector2d middle = kCentre + px_a_m * Eigen::Vector2d(x_m - camera.x(), camera.z());
    const cv::Matx23d map(px_a_texel, 0, middle.x() - px_a_texel * speckles_.cols / 2, 0,
                          px_a_texel, middle.y() - px_a_texel * speckles_.rows / 2);
    cv::Mat wall;
    cv::warpAffine(speckles_ + grey, wall, map, mask_.size());
    return wall;
  }

  cv::Mat Paint(size_t view, int camera) const {
    const Eigen::Vector3d at = WorldFromCamera(views_[view], rig_, camera).translation;
    cv::Mat left = Wall(at, left_m_, 0, 90), image = Wall(at, right_m_, 3, 150);
    const double edge_px = kCentre.x() - kFocal_px / left_m_ * at.x() + 0.5;
    const int column = static_cast<int>(edge_px);
    left.colRange(0, column).copyTo(image.colRange(0, column));
    cv::addWeighted(left.col(column), edge_px - column, image.col(column), 1 - edge_px + column, 0,
                    image.col(column));
    image.convertTo(image, CV_8UC1);
    return image;
  }

  const Views views_;
  const double left_m_, right_m_;
  Rig rig_;
  cv::Mat mask_ = cv::Mat(240, 320, CV_8UC1, cv::Scalar(255));
  cv::Mat1f speckles_ = cv::Mat1f(1024, 2048);
};

// What is said of the line at x = 0, in front, with walls at these distances.
SideVotes VotesAt(double left_m, double right_m, int count = 5) {
  Views views;
  TrackedLine line;
  line.line = {{0, kFront_m, 0}, -Eigen::Vector3d::UnitZ()};
  line.intervals = {{-0.3, 0.3}};
  for (int view = 0; view < count; ++view) {
    views.push_back(testing::LookingAtWall({0.1 * view - 0.1, 0, 0}, view));
    line.places.push_back({.view = view, .samples = 10, .from_m = -0.3F, .to_m = 0.3F});
  }
  std::vector<TrackedLine> lines{line};
  CompareSides(views, SpeckledWalls(views, left_m, right_m), {}, &lines, {});
  return lines[0].sides;
}

TEST(LineSides, AMarkIsOnOnePlaneAndBehindAnEdgeLiesAnotherSurface) {
  const SideVotes mark = VotesAt(kFront_m, kFront_m), edge = VotesAt(kFront_m, 2.6);
  ASSERT_GT(mark.pieces, 0);
  EXPECT_LT(mark.behind, -2 * mark.pieces);
  ASSERT_GT(edge.pieces, 0);
  EXPECT_GT(edge.behind, 2 * edge.pieces);
  EXPECT_EQ(VotesAt(kFront_m, kFront_m, 1).pieces, 0) << "one view says nothing";
}

}  // namespace
}  // namespace slcmap
