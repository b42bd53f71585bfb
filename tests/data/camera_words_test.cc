#include "data/calibration/camera_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slcmap {
namespace {

using ::testing::HasSubstr;

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
}

TEST(CameraWords, AFisheyeWithFewCoefficients) {
  EXPECT_EQ(Read({"pinhole", "fisheye", kPinhole, {0.1}}).coefficients,
            Eigen::Vector4d(0.1, 0, 0, 0));
}

TEST(CameraWords, LensesHaveTheirNumbersFirst) {
  const Camera omni = Read({"omni", "radtan", {1.2, 400, 401, 320, 240}, {-0.1, 0, 0, 0}});
  EXPECT_EQ(omni.distortion, Distortion::kOmni);
  EXPECT_EQ(omni.shape[0], 1.2);
  EXPECT_EQ(omni.fy_px, 401);
  const Camera ucm = Read({"ucm", "none", {0.6, 400, 401, 320, 240}, {}});
  EXPECT_EQ(ucm.distortion, Distortion::kExtendedUnified);
  EXPECT_EQ(ucm.shape, Eigen::Vector2d(0.6, 1));
}

TEST(CameraWords, BasaltsNamesAndOrder) {
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

TEST(CameraWords, NamesOfDistortionsReadBack) {
  for (const Distortion distortion :
       {Distortion::kNone, Distortion::kRadialTangential, Distortion::kEquidistant,
        Distortion::kOmni, Distortion::kExtendedUnified, Distortion::kDoubleSphere,
        Distortion::kFieldOfView}) {
    EXPECT_EQ(FindDistortion(GetName(distortion)), distortion);
  }
  EXPECT_STREQ(GetName(Distortion::kRadialTangential), "radial-tangential");  // as runs have it
  EXPECT_FALSE(FindDistortion("barrel"));
}

}  // namespace
}  // namespace slcmap
