#include "data/rig/bag_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "data/rig/topics.h"
#include "tests/data/rig/made_rig_bag.h"
#include "tests/testing/caught.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MadeRigBag;

const cv::Size kRigSize(640, 480);
const RigidTransform kImuLeft{ExpRotation({0.01, -0.02, 0.03}), {0.02, -0.01, 0.005}};
const RigidTransform kAside{Eigen::Quaterniond::Identity(), {0.05, 0, 0}};
// Of a camera whose link looks along x.
const RigidTransform kLinkOptical{
    ExpRotation({-1.2091995761561452, 1.2091995761561452, -1.2091995761561452}), {0, 0, 0}};

// Of a rectified pair; `baseline_term` is P[3].
RosCameraInfo RectifiedInfo(const std::string& frame, double baseline_term) {
  RosCameraInfo info;
  info.frame_id = frame;
  info.width_px = 640;
  info.height_px = 480;
  info.distortion_model = "plumb_bob";
  info.d = {0, 0, 0, 0, 0};
  info.k = {400, 0, 320, 0, 400, 240, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {400, 0, 320, baseline_term, 0, 400, 240, 0, 0, 0, 1, 0};
  return info;
}

struct RigNames {
  std::string left, right, left_info, right_info, imu;
};
const RigNames kRealSense{"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw",
                          "/camera/infra1/camera_info", "/camera/infra2/camera_info",
                          "/camera/imu"};
const RigNames kZedRaw{"/zed/zed_node/left_raw/image_raw_gray",
                       "/zed/zed_node/right_raw/image_raw_gray",
                       "/zed/zed_node/left_raw/camera_info", "/zed/zed_node/right_raw/camera_info",
                       "/zed/zed_node/imu/data"};
const RigNames kOak{"/oak/left/image_raw", "/oak/right/image_raw", "/oak/left/camera_info",
                    "/oak/right/camera_info", "/oak/imu/data"};
const RigNames kFisheyes{"/camera/fisheye1/image_raw", "/camera/fisheye2/image_raw",
                         "/camera/fisheye1/camera_info", "/camera/fisheye2/camera_info",
                         "/camera/imu"};

void AddStreams(const RigNames& names, MadeRigBag* bag) {
  bag->AddImage(names.left, kRigSize, "left_optical");
  bag->AddImage(names.right, kRigSize, "right_optical");
  bag->AddImu(names.imu, "imu");
}

// The chain from the IMU to the left camera, over a link and with a slash.
void AddImuFrames(MadeRigBag* bag) {
  const RigidTransform T_link_left = kLinkOptical;
  bag->AddFrames("/tf_static", {{"/link", "/imu", T_link_left * kImuLeft.Inverse()},
                                {"link", "left_optical", T_link_left}});
}

Calibration ReadOf(const MadeRigBag& made, Warnings* warnings, const std::string& beside = "") {
  const auto bag = made.Open();
  return ReadBagCalibration(ChooseTopics(bag.get(), {}), beside, bag.get(), warnings);
}

std::string FaultOf(const MadeRigBag& made, const std::string& beside = "") {
  Warnings warnings;
  const auto fault = testing::Caught<InputFault>([&] { ReadOf(made, &warnings, beside); });
  return fault.what() + ("; " + fault.remedy());
}

void ExpectPoses(const Rig& rig, const RigidTransform& T_left_right, double within = 1e-9) {
  EXPECT_LT((rig.T_imu_camera[0].Matrix() - kImuLeft.Matrix()).norm(), within);
  EXPECT_LT((rig.T_imu_camera[1].Matrix() - (kImuLeft * T_left_right).Matrix()).norm(), within);
}

Calibration ReadRectified(double left_term, double right_term, Warnings* warnings,
                          const std::string& form = "mcap") {
  MadeRigBag bag(form);
  AddStreams(kRealSense, &bag);
  bag.Add(kRealSense.left_info, RectifiedInfo("left_optical", left_term));
  bag.Add(kRealSense.right_info, RectifiedInfo("left_optical", right_term));
  AddImuFrames(&bag);
  return ReadOf(bag, warnings);
}

TEST(BagCalibration, RectifiedImagesHaveTheirBaselineOnEitherSide) {
  for (const char* form : {"mcap", "bag"}) {
    Warnings warnings;
    const Calibration read = ReadRectified(0, -400 * 0.05, &warnings, form);
    EXPECT_EQ(read.rig.cameras[0].distortion, Distortion::kNone);
    EXPECT_EQ(read.rig.cameras[1].fx_px, 400);
    ExpectPoses(read.rig, kAside);
    EXPECT_TRUE(warnings.entries().empty());
    EXPECT_THAT(read.source, HasSubstr("/camera/infra1/camera_info of rectified images"));
    EXPECT_THAT(read.source, HasSubstr("tf from left_optical to imu"));
    EXPECT_NEAR(read.rig.imu_noise.gyro_noise_rad_s_sqrthz, 2.05e-4, 1e-6);  // of the profile
    EXPECT_EQ(read.without_noise, "");
  }
  Warnings warnings;
  ExpectPoses(ReadRectified(400 * 0.05, 0, &warnings).rig, kAside);
  const Calibration swapped = ReadRectified(0, 400 * 0.05, &warnings);
  ExpectPoses(swapped.rig, kAside.Inverse());
  EXPECT_EQ(warnings.Count(kCamerasSwapped), 1);
}

// OAK's raw images: eight coefficients, R that rectifies, and the baseline at the left camera.
TEST(BagCalibration, RawImagesAreRectifiedByR) {
  const RigidTransform T_left_right{ExpRotation({0.01, -0.015, 0.02}), {0.075, 0.001, -0.001}};
  const RigidTransform T_right_left = T_left_right.Inverse();
  cv::Mat k = (cv::Mat_<double>(3, 3) << 400, 0, 320, 0, 401, 240, 0, 0, 1), d, turn, shift, q;
  std::array<cv::Mat, 2> r, p;
  cv::eigen2cv(Eigen::Matrix3d(T_right_left.rotation.toRotationMatrix()), turn);
  cv::eigen2cv(T_right_left.translation, shift);
  cv::stereoRectify(k, d, k, d, kRigSize, turn, shift, r[0], r[1], p[0], p[1], q);
  MadeRigBag bag;
  AddStreams(kOak, &bag);
  AddImuFrames(&bag);
  for (size_t i = 0; i < 2; ++i) {
    RosCameraInfo info = RectifiedInfo("left_optical", 0);
    info.distortion_model = "rational_polynomial";
    info.d = {-0.1, 0.02, 0.001, 0.0005, 0.01, -0.05, 0.01, 0.002};
    std::copy_n(k.ptr<double>(), 9, info.k.begin());
    std::copy_n(r[i].ptr<double>(), 9, info.r.begin());
    std::copy_n(p[i].ptr<double>(), 12, info.p.begin());
    info.p[3] = i == 0 ? -p[1].at<double>(0, 3) : 0;
    bag.Add(i == 0 ? kOak.left_info : kOak.right_info, info);
  }
  Warnings warnings;
  const Rig rig = ReadOf(bag, &warnings).rig;
  ExpectPoses(rig, T_left_right, 1e-6);
  EXPECT_EQ(rig.cameras[0].distortion, Distortion::kRadialTangential);
  EXPECT_EQ(rig.cameras[1].higher_coefficients[0], 0.01);
}

// ZED's R is the right camera's turn and no rectification.
TEST(BagCalibration, WhereRDoesNotRectifyFramesTellTheRightCamera) {
  const RigidTransform T_left_right{ExpRotation({0, 0.01, 0}), {0.12, 0, 0}};
  const auto fill = [&](MadeRigBag* bag) {
    AddStreams(kZedRaw, bag);
    AddImuFrames(bag);
    RosCameraInfo left = RectifiedInfo("left_optical", 0);
    left.d = {-0.1, 0.02, 0, 0, 0.01, 0, 0, 0};
    left.distortion_model = "rational_polynomial";
    RosCameraInfo right = left;
    right.frame_id = "right_optical";
    right.p[0] = right.k[0] = 403;
    right.p[3] = -403 * 0.12;
    bag->Add(kZedRaw.left_info, left);
    bag->Add(kZedRaw.right_info, right);
  };
  MadeRigBag bag;
  fill(&bag);
  EXPECT_THAT(FaultOf(bag), AllOf(HasSubstr("no baseline in their P and R"),
                                  HasSubstr("missing is the right camera's pose to the left one")));
  bag.AddFrames("/tf_static", {{"left_optical", "right_optical", T_left_right}});
  Warnings warnings;
  ExpectPoses(ReadOf(bag, &warnings).rig, T_left_right);
}

TEST(BagCalibration, FisheyesStandByTheirFramesAndKeepTheProfilesOffset) {
  MadeRigBag bag;
  AddStreams(kFisheyes, &bag);
  AddImuFrames(&bag);
  bag.AddFrames("/tf", {{"left_optical", "right_optical", kAside}});
  for (const auto& [name, frame] :
       {std::pair{kFisheyes.left_info, "left_optical"}, {kFisheyes.right_info, "right_optical"}}) {
    RosCameraInfo info = RectifiedInfo(frame, 0);
    info.distortion_model = "equidistant";
    info.d = {-0.01, 0.03, -0.02, 0.003, 0};
    bag.Add(name, info);
  }
  bag.AddFrames("/tf_static", {{"left_optical", "right_optical", kAside}});
  Warnings warnings;
  const Rig rig = ReadOf(bag, &warnings).rig;
  ExpectPoses(rig, kAside);
  EXPECT_EQ(rig.cameras[1].distortion, Distortion::kEquidistant);
  EXPECT_NEAR(rig.camera_time_offset_s, 0.0056, 1e-12);
}

TEST(BagCalibration, ViewersStreamsHaveTransformsOfTheirOwn) {
  MadeRigBag bag("bag");
  const std::string infra = "/device_0/sensor_0/Infrared_", motion = "/device_0/sensor_2/";
  for (const std::string number : {"1", "2"}) {
    bag.AddImage(infra + number + "/image/data", kRigSize, "", "8UC1");
    RosCameraInfo info = RectifiedInfo("", 0);
    info.p = {};
    info.distortion_model = "Brown Conrady";
    bag.Add(infra + number + "/info/camera_info", info);
  }
  // From the reference, which is here the left camera, to each stream.
  bag.Add(infra + "1/tf/0", testing::ToRos(RigidTransform()));
  bag.Add(infra + "2/tf/0", testing::ToRos(kAside.Inverse()));
  bag.Add(motion + "Gyro_0/tf/0", testing::ToRos(kImuLeft));
  bag.AddImu(motion + "Gyro_0/imu/data");
  bag.AddImu(motion + "Accel_0/imu/data");
  Warnings warnings;
  ExpectPoses(ReadOf(bag, &warnings).rig, kAside);
}

TEST(BagCalibration, WhatIsMissingIsSaidOnceAndCompletedByAFile) {
  MadeRigBag bag;
  AddStreams(kRealSense, &bag);
  bag.Add(kRealSense.left_info, RectifiedInfo("left_optical", 0));
  bag.Add(kRealSense.right_info, RectifiedInfo("left_optical", -400 * 0.05));
  EXPECT_THAT(FaultOf(bag), AllOf(HasSubstr("no tf from 'left_optical' to 'imu'"),
                                  HasSubstr("missing is the left camera's pose to the IMU"),
                                  HasSubstr("cam0: {T_imu_cam: [[")));
  const Eigen::Matrix4d m = kImuLeft.Matrix();
  std::string rows;
  for (int r = 0; r < 4; ++r) {
    rows += fmt::format("  - [{}, {}, {}, {}]\n", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
  }
  const std::string pose = bag.folder().Write("pose.yaml", "cam0:\n  T_imu_cam:\n" + rows);
  Warnings warnings;
  ExpectPoses(ReadOf(bag, &warnings, pose).rig, kAside);

  // A whole calibration is taken as it is.
  Rig other = ReadOf(bag, &warnings, pose).rig;
  other.cameras[0].fx_px = 444;
  WriteKalibrCalibration(bag.folder().Path("rig.yaml"), other);
  EXPECT_EQ(ReadOf(bag, &warnings, bag.folder().Path("rig.yaml")).rig.cameras[0].fx_px, 444);

  MadeRigBag bare;
  bare.AddImage("/cam0/image_raw", {752, 480}, "cam0");
  bare.AddImage("/cam1/image_raw", {752, 480}, "cam1");
  bare.AddImu("/imu0", "imu0");
  EXPECT_THAT(FaultOf(bare), AllOf(HasSubstr("no camera_info of /cam0/image_raw"),
                                   HasSubstr("profile euroc (its calibration is published"),
                                   HasSubstr("cam1: {camera_model: pinhole")));
}

TEST(BagCalibration, OtherSizesAndZerosAreRefused) {
  MadeRigBag bag;
  AddStreams(kRealSense, &bag);
  AddImuFrames(&bag);
  RosCameraInfo info = RectifiedInfo("left_optical", 0);
  info.width_px = 1280;
  bag.Add(kRealSense.left_info, info);
  bag.Add(kRealSense.right_info, RectifiedInfo("left_optical", -20));
  EXPECT_THAT(FaultOf(bag), AllOf(HasSubstr("/camera/infra1/camera_info of 1280 x 480 pixels, "
                                            "while its images have 640 x 480"),
                                  HasSubstr("missing is the left camera's intrinsics")));
  MadeRigBag zeros;
  AddStreams(kRealSense, &zeros);
  RosCameraInfo none = RectifiedInfo("left_optical", 0);
  none.k = {};
  none.p = {};
  zeros.Add(kRealSense.left_info, none);
  EXPECT_THAT(FaultOf(zeros), HasSubstr("infra1/camera_info: found zeros as K and P"));
}

// camera_info is of a sensor of which the images are a part, in pixels of two by two; the driver
// has no calibration and no image at first.
TEST(BagCalibration, InfoOfTheWholeSensorIsCutOutAndBlankMessagesArePassedOver) {
  MadeRigBag bag;
  bag.AddImage(kRealSense.left, {0, 0}, "left_optical");
  AddStreams(kRealSense, &bag);
  AddImuFrames(&bag);
  bag.Add(kRealSense.left_info, RosCameraInfo());
  for (const auto& [name, term] :
       {std::pair{kRealSense.left_info, 0.0}, std::pair{kRealSense.right_info, -40.0}}) {
    RosCameraInfo info = RectifiedInfo("left_optical", term);
    info.width_px = 1500, info.height_px = 1000;
    info.binning_x = info.binning_y = 2;
    info.roi_x_px = 100, info.roi_y_px = 20, info.roi_width_px = 1280, info.roi_height_px = 960;
    info.k = {800, 0, 740, 0, 800, 500, 0, 0, 1};
    info.p = {800, 0, 740, 2 * term, 0, 800, 500, 0, 0, 0, 1, 0};
    bag.Add(name, info);
  }
  Warnings warnings;
  const Rig rig = ReadOf(bag, &warnings).rig;
  EXPECT_EQ(rig.cameras[0].fx_px, 400);
  EXPECT_EQ(rig.cameras[0].cx_px, 320);
  EXPECT_EQ(rig.cameras[1].cy_px, 240);
  ExpectPoses(rig, {Eigen::Quaterniond::Identity(), {0.1, 0, 0}});
}

TEST(BagCalibration, PosesThatCannotBeAreCounted) {
  MadeRigBag bag;
  AddStreams(kRealSense, &bag);
  bag.Add(kRealSense.left_info, RectifiedInfo("left_optical", 0));
  bag.Add(kRealSense.right_info, RectifiedInfo("right_optical", -400 * 0.05));
  const RigidTransform elsewhere{Eigen::Quaterniond::Identity(), {0.2, 0, 0}};
  bag.AddFrames("/tf_static", {{"imu", "left_optical", RigidTransform()},
                               {"left_optical", "right_optical", elsewhere},
                               {"base", "right_optical", elsewhere}});
  Warnings warnings;
  ReadOf(bag, &warnings);
  EXPECT_EQ(warnings.Count(kImuPoseIsZero), 1);
  EXPECT_EQ(warnings.Count(kBaselinesDiffer), 1);
  EXPECT_EQ(warnings.Count(kManyParents), 1);
}

TEST(FrameTree, ChainsLeadBothWaysAndNotOverWhatMoves) {
  FrameTree frames;
  const auto add = [&](const char* parent, const char* child, double x_m, bool is_fixed) {
    RosTransformStamped transform;
    transform.frame_id = parent;
    transform.child_frame_id = child;
    transform.transform.translation_m = {x_m, 0, 0};
    frames.Add(transform, is_fixed);
  };
  add("/base", "camera", 1, true);
  add("base", "/imu", 0.25, true);
  add("odom", "base", 0, false);
  EXPECT_NEAR(frames.Find("imu", "/camera")->translation.x(), 0.75, 1e-12);
  EXPECT_NEAR(frames.Find("camera", "imu")->translation.x(), -0.75, 1e-12);
  EXPECT_TRUE(frames.Find("odom", "imu"));
  add("odom", "base", 3, false);
  EXPECT_FALSE(frames.Find("odom", "imu"));
  EXPECT_FALSE(frames.Find("imu", "nowhere"));
  EXPECT_FALSE(FromRos({{0, 0, 0}, {0, 0, 0, 0}}));
}

}  // namespace
}  // namespace slcmap
