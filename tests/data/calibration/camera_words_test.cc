#include "data/calibration/camera_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "data/calibration/mask.h"
#include "data/core/error.h"
#include "tests/testing/caught.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

Camera Read(const CameraWords& words) {
  CameraFault fault;
  const auto camera = GetCamera(words, &fault);
  EXPECT_TRUE(camera.has_value()) << fault.key << ": " << fault.found << ", " << fault.expected;
  return camera.value_or(Camera());
}

CameraFault FaultOf(const CameraWords& words) {
  CameraFault fault;
  EXPECT_FALSE(GetCamera(words, &fault).has_value());
  return fault;
}

const std::vector<double> kPinhole = {400, 401, 320, 240};

TEST(CameraWords, RadialTangentialOfAnyLength) {
  const Camera five = Read({"pinhole", "plumb_bob", kPinhole, {-0.3, 0.1, 1e-3, 2e-3, -0.02}});
  EXPECT_EQ(five.coefficients[3], 2e-3);
  EXPECT_EQ(five.higher_coefficients[0], -0.02);
  const Camera eight = Read({"pinhole", "rational_polynomial", kPinhole, {1, 2, 3, 4, 5, 6, 7, 8}});
  EXPECT_EQ(eight.higher_coefficients[3], 8);
  EXPECT_EQ(Read({"pinhole", "radtan", kPinhole, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0}})
                .higher_coefficients[7],
            12);
  // A fisheye may have few.
  EXPECT_EQ(Read({"pinhole", "fisheye", kPinhole, {0.1}}).coefficients,
            Eigen::Vector4d(0.1, 0, 0, 0));
}

// Lenses have their numbers first, but Basalt's last.
TEST(CameraWords, BasaltsNamesAndOrder) {
  EXPECT_EQ(Read({"ucm", "none", {0.6, 400, 401, 320, 240}, {}}).shape, Eigen::Vector2d(0.6, 1));
  const Camera ds = Read({"ds", "none", {150, 151, 320, 240, -0.2, 0.6}, {}});
  EXPECT_EQ(ds.shape, Eigen::Vector2d(-0.2, 0.6));
  EXPECT_EQ(ds.cy_px, 240);
  EXPECT_EQ(Read({"eucm", "none", {400, 401, 320, 240, 0.6, 1.1}, {}}).shape,
            Eigen::Vector2d(0.6, 1.1));
  EXPECT_EQ(Read({"ucm", "none", {400, 401, 320, 240, 0.6}, {}}).shape, Eigen::Vector2d(0.6, 1));
  const Camera fisheye = Read({"kb4", "none", {400, 401, 320, 240, 0.1, 0.2, 0.3, 0.4}, {}});
  EXPECT_EQ(fisheye.distortion, Distortion::kEquidistant);
  EXPECT_EQ(fisheye.coefficients, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4));
  EXPECT_EQ(Read({"kb4", "equidistant", kPinhole, {0.1, 0.2, 0.3, 0.4}}).coefficients[3], 0.4);
  for (const std::vector<double>& more : {std::vector<double>{}, {2.7}}) {
    std::vector<double> numbers = {400, 401, 320, 240, 1, 2, 3, 4, 5, 6, 7, 8};
    numbers.insert(numbers.end(), more.begin(), more.end());
    const Camera camera = Read({"pinhole-radtan8", "none", numbers, {}});
    EXPECT_EQ(camera.distortion, Distortion::kRadialTangential);
    EXPECT_EQ(camera.coefficients[2], 3);
    EXPECT_EQ(camera.higher_coefficients[3], 8);
  }
}

TEST(CameraWords, WhatIsWrittenIsReadBack) {
  for (const CameraWords& words :
       {CameraWords{"pinhole", "radtan", kPinhole, {-0.3, 0.1, 1e-3, 2e-3}},
        {"pinhole", "radtan", kPinhole, {-0.3, 0.1, 1e-3, 2e-3, -0.02}},
        {"pinhole", "radtan", kPinhole, {-0.3, 0.1, 1e-3, 2e-3, -0.02, 0.1, 0.2, 0.3}},
        {"pinhole", "equidistant", kPinhole, {0.1, 0, 0.01, 0}},
        {"pinhole", "fov", kPinhole, {0.9}},
        {"pinhole", "none", kPinhole, {}},
        {"omni", "radtan", {1.2, 400, 401, 320, 240}, {-0.1, 0, 0, 1e-3}},
        {"eucm", "none", {0.6, 1.1, 400, 401, 320, 240}, {}},
        {"ds", "none", {-0.2, 0.6, 400, 401, 320, 240}, {}}}) {
    const CameraWords back = DescribeCamera(Read(words));
    EXPECT_EQ(back.camera_model, words.camera_model);
    EXPECT_EQ(back.distortion_model, words.distortion_model);
    EXPECT_EQ(back.intrinsics, words.intrinsics);
    EXPECT_EQ(back.coefficients, words.coefficients);
  }
}

TEST(CameraWords, WhatIsNoCameraIsNamed) {
  EXPECT_EQ(FaultOf({"fisheye62", "none", kPinhole, {}}).key, "camera_model");
  EXPECT_THAT(FaultOf({"fisheye62", "none", kPinhole, {}}).expected, HasSubstr("omni, eucm, ds"));
  EXPECT_THAT(FaultOf({"ds", "none", kPinhole, {}}).expected, HasSubstr("xi, alpha, fx"));
  EXPECT_EQ(FaultOf({"ds", "radtan", {0, 0.5, 1, 1, 1, 1}, {0, 0, 0, 0}}).key, "distortion_model");
  EXPECT_EQ(FaultOf({"pinhole", "radtan", kPinhole, {1, 2, 3}}).key, "coefficients");
  EXPECT_EQ(FaultOf({"pinhole", "equidistant", kPinhole, {1, 2, 3, 4, 5}}).key, "coefficients");
  EXPECT_THAT(FaultOf({"pinhole", "radtan", kPinhole, std::vector<double>(14, 0.1)}).found,
              HasSubstr("tilted"));
  EXPECT_EQ(FaultOf({"pinhole", "none", kPinhole, {0.1}}).key, "coefficients");
}

// A camera of the IMU's orientation, turned about y, beside the IMU.
ChainCamera At(int index, double x_m, double turn_rad) {
  return {index,
          testing::PinholeCamera(640, 480, 400, 319.5, 239.5),
          {ExpRotation({0, turn_rad, 0}), {x_m, 0, 0}},
          std::nullopt,
          "chain"};
}

TEST(CameraChoice, BeginsWithTwoThatSeeTheSameFromTwoPlaces) {
  // Two that look ahead, one to each side and one behind.
  const std::vector<ChainCamera> chain = {At(0, 0, 1.6), At(1, 0, 0), At(2, 0.11, 0),
                                          At(3, 0.1, -1.6), At(4, 0, 3.1)};
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(1, 2, 0, 3, 4));
  EXPECT_THAT(ChooseCameras(chain, {3, 1}), ElementsAre(3, 1));
  EXPECT_THAT(ChooseCameras(chain, {4}), ElementsAre(4));
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0.1, 0), At(2, 0.2, 0)}, {}), ElementsAre(0, 1, 2));
  // Pair by pair, wherever they stand in the chain.
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0, 3), At(2, 0.1, 3), At(3, 0.12, 0)}, {}),
              ElementsAre(0, 3, 1, 2));
  // In their order where no two see the same: each for itself.
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0.1, 2), At(2, 0.1, -2)}, {}),
              ElementsAre(0, 1, 2));
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0, 3.1)}, {}), ElementsAre(0, 1));
  for (const std::vector<int>& wanted : {std::vector<int>{0, 5}, {1, 1}, {0, 1, 0}}) {
    EXPECT_THAT(MessageOf<DataError>([&] { ChooseCameras(chain, wanted); }),
                HasSubstr("expected different ones of cam0 cam1"));
  }
}

TEST(CameraChoice, TakesThoseThatCanBeRectified) {
  // One before the other, and wide lenses at right angles.
  std::vector<ChainCamera> chain = {At(0, 0, 0), At(1, 0, 0), At(2, 0.06, 0), At(3, 0.2, 1.3)};
  chain[1].T_imu_camera.translation.z() = 0.2;
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(0, 2, 1, 3));
  // One above the other is a pair too.
  chain = {At(0, 0, 1.6), At(1, 0, 0), At(2, 0, 0)};
  chain[2].T_imu_camera.translation.y() = -0.1;
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(1, 2, 0));
}

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
  Rig without = OneCamera();
  ReadMasks({kNoMask}, &without);
  EXPECT_TRUE(without.masks[0].empty());
}

TEST(Mask, RefusesWhatIsNoMaskOfTheCamera) {
  const testing::TempFolder folder;
  Rig rig = OneCamera();
  const auto refuse = [&](const std::vector<std::string>& paths, const std::string& what,
                          const std::string& remedy = "") {
    const auto fault = testing::Caught<InputFault>([&] { ReadMasks(paths, &rig); });
    EXPECT_THAT(fault.what(), HasSubstr(what));
    EXPECT_THAT(fault.remedy(), HasSubstr(remedy));
  };
  refuse({WriteImage(folder, cv::Mat::zeros(20, 41, CV_8UC1))}, "found 41 x 20 pixels");
  refuse({folder.Write("text.png", "no image")}, "text.png: found no image");
  refuse({kNoMask, kNoMask}, "found 2 masks");
  // All black exchanged is all white, which is no mask either.
  const std::string remedy = "write 255 where nothing is to be looked at";
  refuse({WriteImage(folder, cv::Mat::zeros(20, 40, CV_8UC1))}, "found no white", remedy);
  refuse({WriteImage(folder, cv::Mat(20, 40, CV_8UC1, cv::Scalar(255)))}, "100 % white", remedy);
}

TEST(Mask, RunsAndBack) {
  cv::Mat mask(20, 40, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 3, 2)) = 0;
  mask.row(19) = 0;
  const Camera camera = OneCamera().cameras[0];
  EXPECT_EQ(cv::norm(MaskOfRuns(CollectRuns(mask), camera, "run"), mask, cv::NORM_INF), 0);
  EXPECT_TRUE(MaskOfRuns(CollectRuns(cv::Mat()), camera, "run").empty());
  for (const std::vector<int>& runs : {std::vector<int>{0, 799}, {900, -100}}) {
    EXPECT_THAT(MessageOf<DataError>([&] { MaskOfRuns(runs, camera, "run"); }),
                HasSubstr("run: mask"));
  }
}

}  // namespace
}  // namespace slcmap
