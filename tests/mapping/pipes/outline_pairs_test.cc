#include "mapping/pipes/outline_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mapping/pipes/pipes.h"
#include "tests/mapping/pipes/scene_of_views.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using testing::kViews;
using testing::SceneOfViews;
using testing::Way;

constexpr double kThin_m = 0.02;
constexpr double kSpread_rad = 1.6;

// The places of both outlines, as a view at a place sees them.
using OutlinesFrom = std::pair<Vector2d, Vector2d> (*)(const Vector2d& centre);

std::pair<Vector2d, Vector2d> OfPipe(const Vector2d& centre) {
  const double turn_rad = std::atan2(centre.y(), centre.x());
  const double touching_rad = std::acos(kThin_m / centre.norm());
  return {kThin_m * Way(turn_rad - touching_rad), kThin_m * Way(turn_rad + touching_rad)};
}

std::pair<Vector2d, Vector2d> OfStrip(const Vector2d&) { return {{0, -kThin_m}, {0, kThin_m}}; }

// Dark between the outlines, before something bright.
class BandImages : public ViewImages {
 public:
  BandImages(const MapResult& map, OutlinesFrom outlines) : map_(map), outlines_(outlines) {
    const Camera& camera = map.rectified_rig.cameras[0];
    mask_ = cv::Mat(camera.height_px, camera.width_px, CV_8U, cv::Scalar(255));
  }

  const Rig& rig() const override { return map_.rectified_rig; }
  const cv::Mat& mask(int) const override { return mask_; }

  StereoImage Read(size_t view) const override {
    return {static_cast<int64_t>(view), Painted(view, 0), Painted(view, 1)};
  }

 private:
  cv::Mat Painted(size_t view, int camera) const {
    const RigidTransform T_world_camera =
        map_.keyframes[view].T_world_imu * map_.rectified_rig.T_imu_camera[camera];
    const auto [first, second] = outlines_(T_world_camera.translation.head<2>());
    const auto column = [&](const Vector2d& place) {
      const Eigen::Vector3d p = T_world_camera.Inverse() * Eigen::Vector3d(place.x(), place.y(), 0);
      const Camera& model = map_.rectified_rig.cameras[camera];
      return model.fx_px * p.x() / p.z() + model.cx_px;
    };
    const auto [low, high] = std::minmax({column(first), column(second)});
    cv::Mat image(mask_.size(), CV_8U);
    for (int u = 0; u < image.cols; ++u) {
      const double dark =
          std::clamp(high - (u - 0.5), 0.0, 1.0) - std::clamp(low - (u - 0.5), 0.0, 1.0);
      image.col(u) = cv::Scalar(std::round(180 - 140 * dark));
    }
    cv::GaussianBlur(image, image, {0, 0}, 0.8);
    return image;
  }

  const MapResult& map_;
  const OutlinesFrom outlines_;
  cv::Mat mask_;
};

Views CollectViews(const MapResult& map) {
  Views views;
  for (const StampedPose& pose : map.keyframes)
    views.push_back({pose.stamp_ns, 0, pose.T_world_imu});
  return views;
}

// A scene whose lines are those of a thin pipe.
SceneOfViews ThinPipe() {
  SceneOfViews scene(kSpread_rad);
  scene.map().rectified_rig.T_imu_camera[1].translation = {0.11, 0, 0};
  for (const bool is_first : {true, false}) {
    const auto middle = OfPipe({2, 0});
    const int line = scene.AddLine(is_first ? middle.first : middle.second);
    for (int view = 0; view < kViews; ++view) {
      const auto outlines = OfPipe(scene.Centre(view));
      scene.AddSupport(line, view, is_first ? outlines.first : outlines.second);
    }
  }
  return scene;
}

PipePlace FindPlace(double radius_m, const Vector2d& place) {
  return {{{{place.x(), place.y(), 0}, Eigen::Vector3d::UnitZ()}, radius_m}, {-0.9, 0.9}};
}

std::vector<size_t> AllOf(const Views& views) {
  std::vector<size_t> all(views.size());
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

// From a place and radius that are somewhat off.
TEST(OutlinePairs, AreWhereTheImagesHaveThem) {
  SceneOfViews scene = ThinPipe();
  const BandImages images(scene.map(), OfPipe);
  const Views views = CollectViews(scene.map());
  const Vector2d off(0.001, -0.0015);
  const auto pairs =
      FindOutlinePairs({FindPlace(0.021, off)}, {views, images}, AllOf(views)).front();
  ASSERT_EQ(pairs.size(), 2u * kViews);
  for (const OutlinePair& pair : pairs) {
    const double tenth_px_m = 0.1 * 2 / 450;
    EXPECT_NEAR(pair.offsets_m[0] + pair.normals[0].dot(off), -kThin_m, tenth_px_m);
    EXPECT_NEAR(pair.offsets_m[1] + pair.normals[1].dot(off), kThin_m, tenth_px_m);
  }
}

TEST(OutlinePairs, AreExpectedWhereAPlaceIsInTheImage) {
  SceneOfViews scene = ThinPipe();
  const Views views = CollectViews(scene.map());
  const ViewCameras cameras(views, scene.map().rectified_rig);
  EXPECT_EQ(ExpectedPairs(FindPlace(0.02, {0, 0}), views, cameras).size(), 2u * kViews);
  EXPECT_TRUE(ExpectedPairs(FindPlace(0.02, {5, 0}), views, cameras).empty()) << "behind all views";
  EXPECT_TRUE(ExpectedPairs(FindPlace(0.004, {0, 0}), views, cameras).empty()) << "2 pixels wide";
}

TEST(OutlinePairs, AreNoneWhereNothingIs) {
  SceneOfViews scene = ThinPipe();
  const BandImages images(scene.map(), OfPipe);
  const Views views = CollectViews(scene.map());
  EXPECT_TRUE(FindOutlinePairs({FindPlace(0.02, {0.1, 0.3})}, {views, images}, AllOf(views))
                  .front()
                  .empty());
}

TEST(PipesInImages, ThinOnesAreFoundByTheirWidthInImages) {
  SceneOfViews scene = ThinPipe();
  const Views views = CollectViews(scene.map());
  const BandImages of_pipe(scene.map(), OfPipe), of_strip(scene.map(), OfStrip);
  const PipeImages images{views, of_pipe}, strip{views, of_strip};
  const FoundPipes found = FindPipes(scene.map(), {}, &images);
  ASSERT_EQ(found.pipes.size(), 1u);
  EXPECT_NEAR(found.pipes[0].radius_m, kThin_m, 1e-4);
  EXPECT_EQ(found.line_ids, (std::vector<int64_t>{0, 1}));
  EXPECT_TRUE(FindPipes(scene.map(), {}, &strip).pipes.empty()) << "edges";
  EXPECT_TRUE(FindPipes(scene.map(), {}).pipes.empty()) << "without images";
}

// Between the starts of an estimator poses may jump.
TEST(OutlinePairs, AreOfOneSegment) {
  SceneOfViews scene = ThinPipe();
  const BandImages images(scene.map(), OfPipe);
  Views views = CollectViews(scene.map());
  for (size_t i = 0; i < 10; ++i) views[i].segment = 1;
  const auto pairs = FindOutlinePairs({FindPlace(0.02, {0, 0})}, {views, images}, AllOf(views));
  EXPECT_EQ(pairs.front().size(), 2u * (kViews - 10));
  const ViewCameras cameras(views, scene.map().rectified_rig);
  EXPECT_EQ(ExpectedPairs(FindPlace(0.02, {0, 0}), views, cameras).size(), 2u * (kViews - 10));
}

// A lost image is no reason to leave the other one out.
TEST(OutlinePairs, AreOfTheImagesThatAreThere) {
  class WithoutRight : public BandImages {
   public:
    using BandImages::BandImages;
    StereoImage Read(size_t view) const override {
      StereoImage pair = BandImages::Read(view);
      pair.right.release();
      return pair;
    }
  };
  SceneOfViews scene = ThinPipe();
  const WithoutRight images(scene.map(), OfPipe);
  const Views views = CollectViews(scene.map());
  const auto pairs = FindOutlinePairs({FindPlace(0.02, {0, 0})}, {views, images}, AllOf(views));
  EXPECT_EQ(pairs.front().size(), static_cast<size_t>(kViews));
}

// A level pipe that runs away from the camera: each place of it is off by its own number of pixels.
TEST(OutlinePairs, AreMeasuredAlongWhatRunsAway) {
  constexpr double kRadius_m = 0.05, kGuess_m = 0.053, kAside_m = 0.6;
  class Away : public BandImages {
   public:
    using BandImages::BandImages;
    StereoImage Read(size_t) const override {
      // Both outlines of a pipe along x, 0.6 m to the left of the camera, which looks along x.
      cv::Mat image(480, 752, CV_8U, cv::Scalar(180));
      for (int v = 0; v < image.rows; ++v) {
        for (int u = 0; u < image.cols; ++u) {
          const Vector2d ray((u - 376) / 450.0, (v - 240) / 450.0);
          // As seen along the axis, the ray leaves the camera in the direction of its own image.
          const double off_m = std::abs(kAside_m * ray.y()) / ray.norm();
          if (ray.x() < 0 && off_m < kRadius_m) image.at<uchar>(v, u) = 40;
        }
      }
      cv::GaussianBlur(image, image, {0, 0}, 0.8);
      return {0, image, {}};
    }
  };
  MapResult map;
  map.rectified_rig.cameras.assign(2, testing::PinholeCamera(752, 480, 450, 376, 240));
  Eigen::Matrix3d R;
  R.col(2) = Eigen::Vector3d::UnitX();
  R.col(1) = -Eigen::Vector3d::UnitZ();
  R.col(0) = R.col(1).cross(R.col(2));
  const Views views{{0, 0, {Eigen::Quaterniond(R), Eigen::Vector3d::Zero()}}};
  const Away images(map, OfPipe);
  const PipePlace place{{{{0, kAside_m, 0}, Eigen::Vector3d::UnitX()}, kGuess_m}, {1, 4}};
  const auto pairs = FindOutlinePairs({place}, {views, images}, {0}).front();
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].offsets_m[1] - pairs[0].offsets_m[0], 2 * kRadius_m, 0.0008);
}

TEST(PipesInImages, AreNoneOnceTheWorkIsStopped) {
  SceneOfViews scene = ThinPipe();
  const Views views = CollectViews(scene.map());
  const BandImages of_pipe(scene.map(), OfPipe);
  const PipeImages images{views, of_pipe};
  int reports = 0;
  const Progress counting([&](double) { return ++reports > 0; });
  ASSERT_EQ(FindPipes(scene.map(), {}, &images, counting).pipes.size(), 1u);
  for (int most = 0; most < reports; most += 1 + reports / 10) {
    int done = 0;
    const Progress stopped([&](double) { return done++ < most; });
    EXPECT_TRUE(FindPipes(scene.map(), {}, &images, stopped).pipes.empty()) << most;
  }
}

}  // namespace
}  // namespace slcmap
