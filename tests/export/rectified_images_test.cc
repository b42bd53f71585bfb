#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "data/core/error.h"
#include "export/sfm/model.h"
#include "export/sfm/text_models.h"
#include "mapping/map/map.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

// Of the small sequence, whose cameras have distortion: two keyframes, rectified to the same
// pinholes without it.
MapResult MapOfSmallSequence(const testing::TempFolder& temp) {
  testing::WriteSequence(temp, {});
  MapResult map;
  map.source.sequence = temp.Path("");
  Eigen::Matrix3d R_imu_camera;
  R_imu_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (std::size_t i = 0; i < 2; ++i) {
    Camera& camera = map.rectified_rig.cameras[i];
    camera.width_px = 96;
    camera.height_px = 64;
    camera.fx_px = camera.fy_px = 60;
    camera.cx_px = 47.5;
    camera.cy_px = 31.5;
    map.rectified_rig.T_imu_camera[i].rotation = Eigen::Quaterniond(R_imu_camera);
  }
  map.keyframes = {{testing::ImageStamp(1), {}}, {testing::ImageStamp(3), {}}};
  return map;
}

TEST(RectifiedImages, AreWrittenUnderTheirNamesInTheModel) {
  const testing::TempFolder temp;
  const MapResult map = MapOfSmallSequence(temp);
  const auto paths = ColmapWriter({.images = "rectified"}).Write(temp.Path("out"), map, {});
  EXPECT_EQ(paths.size(), 3u + 4);
  for (const ModelImage& image : ModelImages(map)) {
    const cv::Mat rectified =
        cv::imread(temp.Path("out/colmap/images/" + image.name), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(rectified.size(), cv::Size(96, 64)) << image.name;
    // A column beside the middle shows what the camera has nearer to it, by its distortion.
    const int index = image.stamp_ns == testing::ImageStamp(1) ? 1 : 3;
    const cv::Mat raw = testing::Texture(index, 4 * image.camera, {96, 64});
    const auto rows = cv::Range(28, 36);
    const auto grey = [&](const cv::Mat& of, int column) {
      return cv::mean(of(rows, cv::Range(column, column + 1)))[0];
    };
    for (const int off_px : {-30, 30}) {
      const double x = off_px / 60.0;
      const double bent_px = 60 * x * (1 - 0.1 * x * x + 0.01 * std::pow(x, 4));
      const double at_px = 47.5 + bent_px;
      const int left_px = static_cast<int>(std::floor(at_px));
      const double part = at_px - left_px;
      const double expected = (1 - part) * grey(raw, left_px) + part * grey(raw, left_px + 1);
      // Columns of rectified images are at 47.5 + off_px, between two pixels.
      const double found = 0.5 * (grey(rectified, 47 + off_px) + grey(rectified, 48 + off_px));
      EXPECT_NEAR(found, expected, 8) << image.name << " " << off_px;
    }
  }
}

TEST(RectifiedImages, ARecordingThatIsMissingOrAnotherIsNamed) {
  const testing::TempFolder temp;
  MapResult map = MapOfSmallSequence(temp);
  const ColmapWriter writer({.images = "rectified"});
  map.keyframes[0].stamp_ns += 1'000'000'000'000;
  map.keyframes[1].stamp_ns += 1'000'000'000'000;
  EXPECT_THAT([&] { writer.Write(temp.Path("out"), map, {}); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("found none of the 4 images")));
  map.source.sequence = temp.Path("moved");
  EXPECT_THAT([&] { writer.Write(temp.Path("out"), map, {}); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("--sequence names where it moved to")));
  EXPECT_THROW(ColmapOptions{.images = "raw"}.Check(), ConfigError);
}

}  // namespace
}  // namespace slcmap
