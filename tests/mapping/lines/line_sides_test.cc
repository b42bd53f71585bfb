#include "mapping/lines/line_sides.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

constexpr double kFront_m = 2;

// A speckled wall up to x = 0, and another, brighter one behind it or beside it from there on.
class SpeckledWalls : public ViewImages {
 public:
  SpeckledWalls(Views views, double left_m, double right_m)
      : views_(std::move(views)), left_m_(left_m), right_m_(right_m) {
    for (int i = 0; i < 2; ++i) {
      rig_.cameras[i] = testing::PinholeCamera(320, 240, 250, 159.5, 119.5);
      rig_.T_imu_camera[i].translation.x() = 0.11 * i;
    }
    mask_ = cv::Mat(240, 320, CV_8UC1, cv::Scalar(255));
    speckles_ = cv::Mat(kSide, kSide, CV_32FC1);
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
  static constexpr int kSide = 1024;
  static constexpr double kTexel_m = 0.008;

  double Speckle(double x_m, double z_m) const {
    const auto wrap = [](double at_m) {
      const double texel = at_m / kTexel_m;
      return static_cast<int>(std::floor(texel)) & (kSide - 1);
    };
    return speckles_.at<float>(wrap(z_m), wrap(x_m));
  }

  double GreyAlong(const Eigen::Vector3d& centre, const Eigen::Vector3d& ray) const {
    for (const double wall_m : {left_m_, right_m_}) {
      const bool is_left = wall_m == left_m_;
      const Eigen::Vector3d p = centre + (wall_m - centre.y()) / ray.y() * ray;
      if (is_left && p.x() < 0) return 90 + Speckle(p.x(), p.z());
      if (left_m_ == right_m_ || !is_left) return 150 + Speckle(p.x() + 3.1, p.z());
    }
    return 0;
  }

  cv::Mat Paint(size_t view, int camera) const {
    const RigidTransform T_world_camera = WorldFromCamera(views_[view], rig_, camera);
    cv::Mat image(240, 320, CV_8UC1);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        double sum = 0;  // over four rays
        for (const double v : {-0.25, 0.25}) {
          for (const double u : {-0.25, 0.25}) {
            const Eigen::Vector3d ray((column + u - 159.5) / 250, (row + v - 119.5) / 250, 1);
            sum += GreyAlong(T_world_camera.translation, T_world_camera.rotation * ray);
          }
        }
        image.at<uchar>(row, column) = cv::saturate_cast<uchar>(sum / 4);
      }
    }
    return image;
  }

  const Views views_;
  const double left_m_, right_m_;
  Rig rig_;
  cv::Mat mask_, speckles_;
};

// What is said of the line at x = 0, in front, with walls at these distances.
SideVotes VotesAt(double left_m, double right_m) {
  Views views;
  for (int i = 0; i < 5; ++i) views.push_back(testing::LookingAtWall({0.1 * i - 0.1, 0, 0}, i));
  TrackedLine line;
  line.line = {{0, kFront_m, 0}, -Eigen::Vector3d::UnitZ()};
  line.intervals = {{-0.3, 0.3}};
  for (int view = 0; view < 5; ++view) {
    line.places.push_back({.view = view, .samples = 10, .from_m = -0.3F, .to_m = 0.3F});
  }
  std::vector<TrackedLine> lines{line};
  CompareSides(views, SpeckledWalls(views, left_m, right_m), {}, &lines, {});
  return lines[0].sides;
}

TEST(LineSides, AMarkIsOnOnePlane) {
  const SideVotes mark = VotesAt(kFront_m, kFront_m);
  ASSERT_GT(mark.pieces, 0);
  EXPECT_LT(mark.behind, -2 * mark.pieces);
}

TEST(LineSides, BehindAnEdgeLiesAnotherSurface) {
  const SideVotes edge = VotesAt(kFront_m, 2.6);
  ASSERT_GT(edge.pieces, 0);
  EXPECT_GT(edge.behind, 2 * edge.pieces);
}

TEST(LineSides, OneViewSaysNothing) {
  const Views one{testing::LookingAtWall({0, 0, 0}, 1)};
  std::vector<TrackedLine> lines(1);
  lines[0].line = {{0, kFront_m, 0}, -Eigen::Vector3d::UnitZ()};
  lines[0].intervals = {{-0.3, 0.3}};
  lines[0].places = {{.samples = 10, .from_m = -0.3F, .to_m = 0.3F}};
  CompareSides(one, SpeckledWalls(one, 2, 2), {}, &lines, {});
  EXPECT_EQ(lines[0].sides.pieces, 0);
}

}  // namespace
}  // namespace slcmap
