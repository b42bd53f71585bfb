// Revisits of a textured room, recognised by the points of its walls.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <set>

#include "mapping/adjustment/adjustment_problem.h"
#include "mapping/adjustment/closure.h"
#include "odometry/geometry/pinhole.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int kViews = 19;

// Along a wall and back, looking at it all the time.
MotionSpline OutAndBack() {
  constexpr double kKnot_s = 0.1, kDuration_s = 20, kReach_m = 1.5;
  const Eigen::Quaterniond attitude =
      CameraLookingAlong(Vector3d::UnitY()) * SmallRig().T_imu_camera[0].rotation.conjugate();
  std::vector<RigidTransform> control;
  for (double t_s = 0; t_s < kDuration_s + 0.5; t_s += kKnot_s) {
    const double x_m = kReach_m * (1 - std::cos(2 * M_PI * t_s / kDuration_s));
    control.emplace_back(attitude, Vector3d(x_m, 0, 0));
  }
  return MotionSpline(kKnot_s, control);
}

// Dots as far apart in all images, whatever they look at.
cv::Mat Dots(const cv::Size& size) {
  constexpr int kPeriod_px = 8;
  cv::Mat image(size, CV_8UC1, cv::Scalar(40));
  for (int x = 0; x < size.width; x += kPeriod_px) {
    for (int y = 0; y < size.height; y += kPeriod_px) {
      cv::rectangle(image, {x, y, kPeriod_px / 2, kPeriod_px / 2}, cv::Scalar(200), cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.8);
  return image;
}

class WallImages final : public ViewImages {
 public:
  WallImages() : task_{SmallRig(), OutAndBack(), {}} {
    for (int i = 0; i < kViews; ++i) task_.times_s.push_back(0.5 + i);
    renderer_ = std::make_unique<BoxRoomRenderer>(task_, 3.0);
  }

  RigidTransform TruePose(size_t view) const { return task_.motion.PoseAt(task_.times_s[view]); }
  RenderedPair Render(size_t view) const { return renderer_->Render(static_cast<int>(view), true); }
  void ShowDots() { shows_dots_ = true; }

  const Rig& rig() const override { return task_.rig; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    const RenderedPair pair = Render(view);
    if (!shows_dots_) return {ToNanoseconds(task_.times_s[view]), pair.left, pair.right};
    return {ToNanoseconds(task_.times_s[view]), Dots(pair.left.size()), {}};
  }

 private:
  RenderTask task_;
  std::unique_ptr<BoxRoomRenderer> renderer_;
  cv::Mat mask_;
  bool shows_dots_ = false;
};

// The corners of a view, seen in it and in the next one.
void AddCorners(const WallImages& images, size_t view, OdometryRun* run) {
  const Camera& camera = images.rig().cameras[0];
  const RenderedPair pair = images.Render(view);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(pair.left, corners, 80, 0.01, 8);
  const auto T_world_camera = [&](size_t of) {
    return images.TruePose(of) * images.rig().T_imu_camera[0];
  };
  for (const cv::Point2f& corner : corners) {
    const Eigen::Vector2d px(corner.x, corner.y);
    const double depth_m = pair.depth_m.at<float>(static_cast<int>(std::lround(corner.y)),
                                                  static_cast<int>(std::lround(corner.x)));
    if (!(depth_m > 0.5)) continue;
    const Vector3d p_true =
        T_world_camera(view) * Vector3d(depth_m * PlaneFromPixel(camera, px).homogeneous());
    const int64_t id = std::ssize(run->landmarks);
    const size_t next = std::min<size_t>(view + 1, kViews - 1);
    run->landmarks.push_back({id, 0, p_true, 0.01, 2});
    run->keyframes[view].observations.push_back({id, px, {}});
    if (next == view) continue;
    const Vector3d p_next = T_world_camera(next).Inverse() * p_true;
    run->keyframes[next].observations.push_back(
        {id, PixelFromPlane(camera, p_next.hnormalized()), {}});
  }
}

// A run that has drifted by so much when it comes back.
OdometryRun RunWithDrift(const WallImages& images, const Vector3d& drift_m) {
  OdometryRun run;
  run.rectified_rig = images.rig();
  for (size_t k = 0; k < kViews; ++k) {
    run.keyframes.push_back({static_cast<int64_t>(k),
                             0,
                             ToNanoseconds(0.5 + static_cast<double>(k)),
                             images.TruePose(k),
                             {},
                             {}});
  }
  for (size_t k = 0; k < kViews; ++k) {
    const size_t first = run.landmarks.size();
    AddCorners(images, k, &run);
    if (k <= kViews / 2) continue;
    run.keyframes[k].T_world_imu.translation += drift_m;
    for (size_t i = first; i < run.landmarks.size(); ++i) run.landmarks[i].p_world += drift_m;
  }
  return run;
}

std::vector<Closure> Find(const WallImages& images, const Vector3d& drift_m,
                          const ClosureOptions& closures) {
  AdjustmentOptions options;
  options.closures = closures;
  const OdometryRun run = RunWithDrift(images, drift_m);
  const AdjustmentModel model(run, options);
  return FindPointClosures(StateOfRun(run, options), images, model.points, options.closures);
}

// The images are small: what is 2 px in others is less in them.
ClosureOptions ForSmallImages() {
  ClosureOptions options;
  options.min_path_m = 2;
  options.min_interval_s = 5;
  options.point_tolerance_px = 0.5;
  return options;
}

TEST(PointClosures, TellHowFarVisitsAreApart) {
  const Vector3d drift_m(0.012, 0.004, -0.008);
  const std::vector<Closure> closures = Find(WallImages(), drift_m, ForSmallImages());
  ASSERT_GE(closures.size(), 3u);
  for (const Closure& closure : closures) {
    EXPECT_LT((closure.shift.head<3>() + drift_m).norm(), 0.005) << closure.shift.transpose();
    EXPECT_GE(closure.points.size(), 15u);
    EXPECT_LT(closure.older_frame, closure.newer_frame);
  }
}

TEST(PointClosures, OfManySomeAreKeptEvenlyAlongTheWay) {
  const WallImages images;
  ClosureOptions options = ForSmallImages();
  const std::vector<Closure> all = Find(images, Vector3d::Zero(), options);
  ASSERT_GE(all.size(), 4u);
  options.max_point_closures = 2;
  const std::vector<Closure> some = Find(images, Vector3d::Zero(), options);
  ASSERT_EQ(some.size(), 2u);
  EXPECT_EQ(some[0].newer_frame, all[0].newer_frame);
  EXPECT_EQ(some[1].newer_frame, all[(all.size() + 1) / 2].newer_frame);
}

TEST(PointClosures, BeyondWhatOdometryMayHaveDriftedThereAreNone) {
  EXPECT_TRUE(Find(WallImages(), {0.3, 0, 0.1}, ForSmallImages()).empty());
}

// What repeats within the gate, as doors one period apart would, fits several shifts alike.
TEST(PointClosures, OfWhatLooksAlikeThereAreNone) {
  WallImages images;
  ClosureOptions options = ForSmallImages();
  options.gate_m = 0.3;
  const Vector3d drift_m(0.05, 0, 0.02);
  EXPECT_FALSE(Find(images, drift_m, options).empty());
  images.ShowDots();
  EXPECT_TRUE(Find(images, drift_m, options).empty());
}

// As if the run had followed the points of the way out all the way back.
void FollowAll(const WallImages& images, OdometryRun* run) {
  const Camera& camera = images.rig().cameras[0];
  for (size_t k = kViews / 2 + 1; k < kViews; ++k) {
    const RigidTransform T_world_camera = images.TruePose(k) * images.rig().T_imu_camera[0];
    auto& observations = run->keyframes[k].observations;
    std::set<int64_t> seen;
    for (const auto& observation : observations) seen.insert(observation.landmark_id);
    for (const Landmark& landmark : run->landmarks) {
      const Vector3d p = T_world_camera.Inverse() * landmark.p_world;
      if (p.z() < 0.5 || !seen.insert(landmark.id).second) continue;
      observations.push_back({landmark.id, PixelFromPlane(camera, p.hnormalized()), {}});
    }
  }
}

TEST(PointClosures, WhatOdometryFollowedAllTheWayIsNoRevisit) {
  const WallImages images;
  AdjustmentOptions options;
  options.closures = ForSmallImages();
  OdometryRun run = RunWithDrift(images, Vector3d::Zero());
  FollowAll(images, &run);
  const AdjustmentModel model(run, options);
  EXPECT_TRUE(
      FindPointClosures(StateOfRun(run, options), images, model.points, options.closures).empty());
}

}  // namespace
}  // namespace slcmap
