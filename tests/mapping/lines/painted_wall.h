// Views of a dark wall with bright rectangles on it, for tests of lines.
#pragma once

#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/views/view.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

// A wall in the plane z = 0 of the wall's frame, which is the world turned so that the cameras,
// with their z along the world's y, look at it: x of the world is right, z up.
struct WallRectangle {
  double left_m, right_m, bottom_m, top_m;
  double turn_rad = 0;  // about its middle
};

inline constexpr double kWallDistance_m = 2;

class PaintedWall : public ViewImages {
 public:
  // Views from `blind_from` on show nothing.
  PaintedWall(const Views& views, const std::vector<WallRectangle>& rectangles = {},
              size_t blind_from = 1000) {
    for (int i = 0; i < 2; ++i) {
      rig_.cameras[i] = PinholeCamera(480, 320, 300, 239.5, 159.5);
      rig_.T_imu_camera[i].translation.x() = 0.11 * i;
    }
    for (const View& view : views) {
      const bool is_blank = rectangles.empty() || images_.size() >= blind_from;
      const auto paint = [&](int camera) {
        return is_blank ? cv::Mat(320, 480, CV_8UC1, cv::Scalar(60))
                        : Paint(WorldFromCamera(view, rig_, camera).Inverse(), rectangles);
      };
      images_.push_back({view.stamp_ns, paint(0), paint(1)});
    }
  }

  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override { return images_[view]; }

 private:
  // Four times finer and then averaged: edges are as a camera's pixels see them.
  static cv::Mat Paint(const RigidTransform& T_camera_world,
                       const std::vector<WallRectangle>& rectangles) {
    constexpr int kFiner = 4, kShift = 8;
    cv::Mat fine(320 * kFiner, 480 * kFiner, CV_8UC1, cv::Scalar(60));
    for (const WallRectangle& r : rectangles) {
      const Eigen::Vector2d middle(0.5 * (r.left_m + r.right_m), 0.5 * (r.bottom_m + r.top_m));
      std::vector<cv::Point> corners;
      for (const auto& [x, z] : {std::pair(r.left_m, r.bottom_m),
                                 {r.right_m, r.bottom_m},
                                 {r.right_m, r.top_m},
                                 {r.left_m, r.top_m}}) {
        const Eigen::Vector2d corner =
            middle + Eigen::Rotation2D(r.turn_rad) * (Eigen::Vector2d(x, z) - middle);
        const Eigen::Vector3d p =
            T_camera_world * Eigen::Vector3d(corner.x(), kWallDistance_m, corner.y());
        const auto at = [&](double px) {
          return static_cast<int>(std::lround(((px + 0.5) * kFiner - 0.5) * (1 << kShift)));
        };
        corners.push_back({at(300 * p.x() / p.z() + 239.5), at(300 * p.y() / p.z() + 159.5)});
      }
      cv::fillConvexPoly(fine, corners, cv::Scalar(170), cv::LINE_8, kShift);
    }
    cv::Mat image;
    cv::resize(fine, image, {480, 320}, 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(image, image, {5, 5}, 0.7);
    return image;
  }

  Rig rig_;
  std::vector<StereoImage> images_;
  cv::Mat mask_ = cv::Mat(320, 480, CV_8UC1, cv::Scalar(255));
};

// The camera looks along the world's y, its x along the world's x, its y down.
inline View LookingAtWall(const Eigen::Vector3d& p_world, int64_t stamp_ns) {
  Eigen::Matrix3d R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {stamp_ns, 0, {Eigen::Quaterniond(R), p_world}};
}

inline Views MovingViews(int count) {
  Views views;
  for (int i = 0; i < count; ++i) {
    views.push_back(LookingAtWall({-0.5 + 0.1 * i, 0, 0.15 * (i % 4)}, 100 + i));
  }
  return views;
}

}  // namespace slcmap::testing
