#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "export/web/page_data.h"
#include "tests/testing/forward_rig.h"
#include "tests/testing/memory_source.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::MemorySource;
using ::testing::ThrowsMessage;

// Keyframes at rest, ten a second.
MapResult StandingMap(int keyframes) {
  MapResult map;
  map.rectified_rig = testing::ForwardRig();
  for (int i = 0; i < keyframes; ++i) {
    map.keyframes.push_back({100000000 * int64_t{i}, RigidTransform()});
  }
  return map;
}

// A camera with distortion that is turned by 6 degrees against the map's.
Rig RawRig() {
  Rig rig = testing::ForwardRig();
  Camera& camera = rig.cameras[0];
  camera.distortion = Distortion::kRadialTangential;
  camera.coefficients = {-0.2, 0.05, 0, 0};
  rig.T_imu_camera[0].rotation =
      rig.T_imu_camera[0].rotation *
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 0).normalized()));
  return rig;
}

// Pairs at the stamps of StandingMap, with that image on the left.
std::vector<StereoImage> Pairs(int count, const cv::Mat& left) {
  std::vector<StereoImage> pairs(count);
  for (int i = 0; i < count; ++i) {
    pairs[i].stamp_ns = 100000000 * int64_t{i};
    pairs[i].left = left;
  }
  return pairs;
}

cv::Mat Decoded(const PageImage& image) {
  const std::vector<uint8_t> bytes(image.jpeg.begin(), image.jpeg.end());
  return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

TEST(ReadPageImages, ShowWhatTheMapsCameraWouldSee) {
  const MapResult map = StandingMap(1);
  const Rig raw = RawRig();
  const Eigen::Vector3d spot_imu(2, 0.5, 0.3);
  const auto pixel_of = [&](const Rig& rig) {
    return *rig.cameras[0].Project(rig.T_imu_camera[0].Inverse() * spot_imu);
  };
  cv::Mat left = cv::Mat::zeros(240, 320, CV_8U);
  const Eigen::Vector2d raw_px = pixel_of(raw);
  cv::circle(left, {cvRound(raw_px.x()), cvRound(raw_px.y())}, 8, 255, cv::FILLED);
  const MemorySource recording(raw, Pairs(1, left), {});
  const auto images = ReadPageImages(map, recording, {.width_px = 160});
  ASSERT_EQ(images.size(), 1u);
  const cv::Mat seen = Decoded(images[0]);
  ASSERT_EQ(seen.size(), cv::Size(160, 120));
  const cv::Moments spot = cv::moments(seen > 128, true);
  // A pixel of the smaller picture is two by two of the camera's.
  const Eigen::Vector2d at_px(2 * spot.m10 / spot.m00 + 0.5, 2 * spot.m01 / spot.m00 + 0.5);
  EXPECT_LT((at_px - pixel_of(map.rectified_rig)).norm(), 1.5) << at_px.transpose();
  EXPECT_GT((raw_px - pixel_of(map.rectified_rig)).norm(), 10);  // else it tells nothing
}

TEST(ReadPageImages, AreOfEveryNthKeyframe) {
  const MemorySource recording(testing::ForwardRig(), Pairs(7, cv::Mat(240, 320, CV_8U, 99)), {});
  std::vector<std::size_t> keyframes;
  for (const PageImage& image : ReadPageImages(StandingMap(7), recording, {.most = 3})) {
    keyframes.push_back(image.keyframe);
  }
  EXPECT_THAT(keyframes, ::testing::ElementsAre(0, 3, 6));
}

TEST(ReadPageImages, AreNotMadeLarger) {
  const MemorySource recording(testing::ForwardRig(), Pairs(1, cv::Mat(240, 320, CV_8U, 99)), {});
  EXPECT_EQ(Decoded(ReadPageImages(StandingMap(1), recording, {})[0]).cols, 320);
}

TEST(ReadPageImages, ThoseThatCannotBeReadAreLeftOut) {
  std::vector<StereoImage> pairs = Pairs(3, cv::Mat(240, 320, CV_8U, 99));
  pairs[1].left.release();
  const MemorySource recording(testing::ForwardRig(), pairs, {});
  EXPECT_EQ(ReadPageImages(StandingMap(3), recording, {}).size(), 2u);
}

TEST(ReadPageImages, AnotherRecordingIsRefused) {
  std::vector<StereoImage> pairs = Pairs(3, cv::Mat(240, 320, CV_8U, 99));
  for (StereoImage& pair : pairs) pair.stamp_ns += 5000000000;
  const MemorySource recording(testing::ForwardRig(), pairs, {});
  EXPECT_THAT([&] { ReadPageImages(StandingMap(3), recording, {}); },
              ThrowsMessage<DataError>(
                  HasSubstr("memory: found none of the images of the map's 3 keyframes")));
  EXPECT_TRUE(ReadPageImages(StandingMap(0), recording, {}).empty());
}

TEST(ReadPageImages, WrongOptionsAreNamed) {
  EXPECT_THAT([] { PageImageOptions{.most = 0}.Check(); },
              ThrowsMessage<ConfigError>(HasSubstr("most: found 0")));
  EXPECT_THAT([] { PageImageOptions{.quality = 101}.Check(); },
              ThrowsMessage<ConfigError>(HasSubstr("quality: found 101")));
}

}  // namespace
}  // namespace slcmap
