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

// Dark between the outlines, before something bright; both cameras are in one place.
class BandImages : public ViewImages {
 public:
  BandImages(const SceneOfViews& scene, const MapResult& map, OutlinesFrom outlines)
      : scene_(scene), map_(map), outlines_(outlines) {
    const Camera& camera = map.rectified_rig.cameras[0];
    mask_ = cv::Mat(camera.height_px, camera.width_px, CV_8U, cv::Scalar(255));
  }

  const Rig& rig() const override { return map_.rectified_rig; }
  const cv::Mat& mask(int) const override { return mask_; }

  StereoImage Read(size_t view) const override {
    const auto [first, second] = outlines_(scene_.Centre(static_cast<int>(view)));
    const auto [low, high] = std::minmax({Column(first, view), Column(second, view)});
    cv::Mat image(mask_.size(), CV_8U);
    for (int u = 0; u < image.cols; ++u) {
      const double dark =
          std::clamp(high - (u - 0.5), 0.0, 1.0) - std::clamp(low - (u - 0.5), 0.0, 1.0);
      image.col(u) = cv::Scalar(std::lround(180 - 140 * dark));
    }
    cv::GaussianBlur(image, image, {0, 0}, 0.8);
    return {static_cast<int64_t>(view), image, image};
  }

 private:
  double Column(const Vector2d& place, size_t view) const {
    const Eigen::Vector3d p =
        map_.keyframes[view].T_world_imu.Inverse() * Eigen::Vector3d(place.x(), place.y(), 0);
    const Camera& camera = map_.rectified_rig.cameras[0];
    return camera.fx_px * p.x() / p.z() + camera.cx_px;
  }

  const SceneOfViews& scene_;
  const MapResult& map_;
  const OutlinesFrom outlines_;
  cv::Mat mask_;
};

Views ViewsOf(const MapResult& map) {
  Views views;
  for (const StampedPose& pose : map.keyframes)
    views.push_back({pose.stamp_ns, 0, pose.T_world_imu});
  return views;
}

// A scene whose lines are those of a thin pipe.
SceneOfViews ThinPipe() {
  SceneOfViews scene(kSpread_rad);
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

PipePlace PlaceOf(double radius_m, const Vector2d& place) {
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
  const BandImages images(scene, scene.map(), OfPipe);
  const Views views = ViewsOf(scene.map());
  const Vector2d off(0.001, -0.0015);
  const auto pairs = FindOutlinePairs({PlaceOf(0.021, off)}, {views, images}, AllOf(views)).front();
  ASSERT_EQ(pairs.size(), 2u * kViews);
  for (const OutlinePair& pair : pairs) {
    const double tenth_px_m = 0.1 * 2 / 450;
    EXPECT_NEAR(pair.offsets_m[0] + pair.normals[0].dot(off), -kThin_m, tenth_px_m);
    EXPECT_NEAR(pair.offsets_m[1] + pair.normals[1].dot(off), kThin_m, tenth_px_m);
  }
}

TEST(OutlinePairs, AreExpectedWhereAPlaceIsInTheImage) {
  SceneOfViews scene = ThinPipe();
  const ViewCameras cameras(ViewsOf(scene.map()), scene.map().rectified_rig);
  EXPECT_EQ(ExpectedPairs(PlaceOf(0.02, {0, 0}), cameras).size(), 2u * kViews);
  EXPECT_TRUE(ExpectedPairs(PlaceOf(0.02, {5, 0}), cameras).empty()) << "behind all views";
  EXPECT_TRUE(ExpectedPairs(PlaceOf(0.005, {0, 0}), cameras).empty()) << "2 pixels wide";
}

TEST(OutlinePairs, AreNoneWhereNothingIs) {
  SceneOfViews scene = ThinPipe();
  const BandImages images(scene, scene.map(), OfPipe);
  const Views views = ViewsOf(scene.map());
  EXPECT_TRUE(
      FindOutlinePairs({PlaceOf(0.02, {0.1, 0.3})}, {views, images}, AllOf(views)).front().empty());
}

TEST(PipesInImages, ThinOnesAreFoundByTheirWidthInImages) {
  SceneOfViews scene = ThinPipe();
  const Views views = ViewsOf(scene.map());
  const BandImages of_pipe(scene, scene.map(), OfPipe), of_strip(scene, scene.map(), OfStrip);
  const PipeImages images{views, of_pipe}, strip{views, of_strip};
  const FoundPipes found = FindPipes(scene.map(), {}, &images);
  ASSERT_EQ(found.pipes.size(), 1u);
  EXPECT_NEAR(found.pipes[0].radius_m, kThin_m, 1e-4);
  EXPECT_EQ(found.line_ids, (std::vector<int64_t>{0, 1}));
  EXPECT_TRUE(FindPipes(scene.map(), {}, &strip).pipes.empty()) << "edges";
  EXPECT_TRUE(FindPipes(scene.map(), {}).pipes.empty()) << "without images";
}

}  // namespace
}  // namespace slcmap
