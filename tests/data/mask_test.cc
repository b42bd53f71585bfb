#include "data/calibration/mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "data/core/error.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Rig OneCamera() {
  Rig rig;
  rig.cameras[0] = testing::PinholeCamera(40, 20, 30, 19.5, 9.5);
  return rig;
}

std::string WriteImage(const testing::TempFolder& folder, const cv::Mat& image) {
  cv::imwrite(folder.Path("mask.png"), image);
  return folder.Path("mask.png");
}

TEST(Mask, WhiteIsLeftOut) {
  const testing::TempFolder folder;
  cv::Mat image = cv::Mat::zeros(20, 40, CV_8UC1);
  image.rowRange(15, 20) = 255;
  Rig rig = OneCamera();
  ReadMasks({WriteImage(folder, image)}, &rig);
  EXPECT_EQ(rig.masks[0].at<uchar>(14, 3), 255);
  EXPECT_EQ(rig.masks[0].at<uchar>(15, 3), 0);
  EXPECT_DOUBLE_EQ(LeftOut(rig.masks[0]), 0.25);
  EXPECT_TRUE(rig.masks[1].empty());
}

TEST(Mask, NoneIsNoFile) {
  Rig rig = OneCamera();
  ReadMasks({kNoMask}, &rig);
  EXPECT_TRUE(rig.masks[0].empty());
}

TEST(Mask, RefusesWhatIsNoMaskOfTheCamera) {
  const testing::TempFolder folder;
  Rig rig = OneCamera();
  const auto refuse = [&](const std::string& path, const std::string& what) {
    EXPECT_THAT([&] { ReadMasks({path}, &rig); }, ThrowsMessage<DataError>(HasSubstr(what)));
  };
  refuse(WriteImage(folder, cv::Mat::zeros(20, 41, CV_8UC1)), "found 41 x 20 pixels");
  refuse(WriteImage(folder, cv::Mat(20, 40, CV_8UC1, cv::Scalar(255))), "100 % white");
  refuse(folder.Write("text.png", "no image"), "text.png: found no image");
  refuse(WriteImage(folder, cv::Mat::zeros(20, 40, CV_8UC1)), "found no white");
  EXPECT_THAT(
      [&] {
        ReadMasks({kNoMask, kNoMask}, &rig);
      },
      ThrowsMessage<DataError>(HasSubstr("found 2 masks")));
}

// All black exchanged is all white, which is no mask either.
TEST(Mask, ARemedyDoesNotLeadToTheNextFault) {
  const testing::TempFolder folder;
  for (const int grey : {0, 255}) {
    Rig rig = OneCamera();
    const cv::Mat image(20, 40, CV_8UC1, cv::Scalar(grey));
    try {
      ReadMasks({WriteImage(folder, image)}, &rig);
      ADD_FAILURE() << grey;
    } catch (const InputFault& fault) {
      EXPECT_THAT(fault.remedy(), HasSubstr("write 255 where nothing is to be looked at"));
    }
  }
}

TEST(Mask, RunsAndBack) {
  cv::Mat mask(20, 40, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 3, 2)) = 0;
  mask.row(19) = 0;
  const Camera camera = OneCamera().cameras[0];
  EXPECT_EQ(cv::norm(MaskOfRuns(CollectRuns(mask), camera, "run"), mask, cv::NORM_INF), 0);
  EXPECT_TRUE(MaskOfRuns(CollectRuns(cv::Mat()), camera, "run").empty());
  EXPECT_THAT(
      [&] {
        MaskOfRuns({0, 799}, camera, "run");
      },
      ThrowsMessage<DataError>(HasSubstr("run: mask")));
  EXPECT_THAT(
      [&] {
        MaskOfRuns({900, -100}, camera, "run");
      },
      ThrowsMessage<DataError>(HasSubstr("run: mask")));
}

}  // namespace
}  // namespace slcmap
