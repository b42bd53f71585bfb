#include "data/bag/messages.h"

#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using testing::MessageOf;

std::vector<std::byte> BytesFromHex(std::string_view hex) {
  std::vector<std::byte> bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

RosImu SomeImu(const std::string& frame) {
  RosImu imu;
  imu.stamp_ns = 1'700'000'000'123'456'789;
  imu.frame_id = frame;
  imu.orientation_xyzw = {0.1, 0.2, 0.3, 0.9};
  imu.angular_velocity_rad_s = {1, 2, 3};
  imu.linear_acceleration_m_s2 = {4, 5, 9.81};
  imu.linear_acceleration_covariance[8] = 7;
  return imu;
}

TEST(Messages, AllFieldsComeBackInBothLayouts) {
  // Sizes as ROS writes them.
  EXPECT_EQ(EncodeMessage(BagEncoding::kCdr, SomeImu("cam")).size(), 316u);
  EXPECT_EQ(EncodeMessage(BagEncoding::kCdr, SomeImu("camera_imu_optical_frame")).size(), 340u);
  EXPECT_EQ(EncodeMessage(BagEncoding::kRos1, SomeImu("cam")).size(), 12u + 7 + 37 * 8);
  for (const BagEncoding encoding : {BagEncoding::kRos1, BagEncoding::kCdr}) {
    const auto imu = DecodeMessage<RosImu>(encoding, EncodeMessage(encoding, SomeImu("imu_link")));
    EXPECT_EQ(imu.stamp_ns, 1'700'000'000'123'456'789);
    EXPECT_EQ(imu.frame_id, "imu_link");
    EXPECT_EQ(imu.linear_acceleration_m_s2[2], 9.81);
    EXPECT_EQ(imu.linear_acceleration_covariance[8], 7);

    RosCameraInfo info;
    info.frame_id = "c";
    info.distortion_model = "equidistant";
    info.d = {1, 2, 3, 4};
    info.p[11] = 5;
    info.roi_width_px = 6;
    info.roi_rectify = true;
    for (const size_t d : {size_t{4}, size_t{0}}) {
      info.d.resize(d);
      const auto read = DecodeMessage<RosCameraInfo>(encoding, EncodeMessage(encoding, info));
      EXPECT_EQ(read.distortion_model, "equidistant");
      EXPECT_EQ(read.d, info.d);
      EXPECT_EQ(read.p[11], 5);
      EXPECT_EQ(read.roi_width_px, 6u);
      EXPECT_TRUE(read.roi_rectify);
    }

    RosTransforms transforms;
    transforms.transforms.resize(2);
    transforms.transforms[1].child_frame_id = "imu";
    transforms.transforms[1].transform = {{1, 2, 3}, {0, 0, 0.6, 0.8}};
    const auto tf = DecodeMessage<RosTransforms>(encoding, EncodeMessage(encoding, transforms));
    ASSERT_EQ(tf.transforms.size(), 2u);
    EXPECT_EQ(tf.transforms[1].child_frame_id, "imu");
    EXPECT_EQ(tf.transforms[1].transform.rotation_xyzw[3], 0.8);
  }
}

TEST(Messages, PixelsAreNotCopiedAndAHeadIsEnoughForTheRest) {
  const std::vector<std::byte> pixels(100 * 80, std::byte{7});
  RosImage image;
  image.stamp_ns = 5;
  image.width_px = image.step_bytes = 100;
  image.height_px = 80;
  image.encoding = "mono8";
  image.data.bytes = pixels;
  for (const BagEncoding encoding : {BagEncoding::kRos1, BagEncoding::kCdr}) {
    const auto bytes = EncodeMessage(encoding, image);
    const auto whole = DecodeMessage<RosImage>(encoding, bytes);
    EXPECT_EQ(whole.data.bytes.data() + pixels.size(), bytes.data() + bytes.size());
    const auto head = DecodeMessage<RosImage>(encoding, BagBytes(bytes).first(200));
    EXPECT_EQ(head.encoding, "mono8");
    EXPECT_EQ(head.data.written, pixels.size());
    EXPECT_LT(head.data.bytes.size(), 200u);
    EXPECT_EQ(DecodeMessage<RosStamped>(encoding, BagBytes(bytes).first(40)).stamp_ns, 5);
  }
}

// A header, and a string: stamp 1 s 2 ns, frame "ab", format "png", data 0102.
TEST(Messages, BigEndianAndEmptyStringsWithoutNul) {
  const auto big = BytesFromHex(
      "00000000"
      "00000001"
      "00000002"
      "00000003616200"
      "00"
      "00000004706e6700"
      "000000020102");
  const auto image = DecodeMessage<RosCompressedImage>(BagEncoding::kCdr, big);
  EXPECT_EQ(image.stamp_ns, 1'000'000'002);
  EXPECT_EQ(image.frame_id, "ab");
  EXPECT_EQ(image.format, "png");
  EXPECT_EQ(image.data.bytes.size(), 2u);
  const auto empty = BytesFromHex(
      "00010000"
      "01000000"
      "02000000"
      "00000000");
  EXPECT_EQ(DecodeMessage<RosStamped>(BagEncoding::kCdr, empty).frame_id, "");
}

TEST(Messages, OtherLayoutsAreRefusedByName) {
  const auto decode = [](const char* hex) {
    return MessageOf<DataError>(
        [&] { DecodeMessage<RosStamped>(BagEncoding::kCdr, BytesFromHex(hex)); });
  };
  EXPECT_NE(decode("000700000000000000000000").find("XCDR2"), std::string::npos);
  EXPECT_NE(decode("000300000000000000000000").find("parameter list"), std::string::npos);
  EXPECT_NE(decode("0001000000000000").find("cut short"), std::string::npos);
  EXPECT_NE(decode("").find("cut short"), std::string::npos);
  // A count that is far beyond what follows.
  EXPECT_NE(MessageOf<DataError>([] {
              DecodeMessage<RosTransforms>(BagEncoding::kRos1, BytesFromHex("ffffffff0000"));
            }).find("cut short"),
            std::string::npos);
}

// The grey of a square image with these bytes in all; empty where the encoding is not known.
cv::Mat GreyOf(const std::string& encoding, uint32_t size_px, const std::vector<std::byte>& data,
               bool is_bigendian = false) {
  RosImage image;
  image.width_px = image.height_px = size_px;
  image.encoding = encoding;
  image.is_bigendian = is_bigendian;
  image.step_bytes = static_cast<uint32_t>(data.size()) / size_px;
  image.data.bytes = data;
  return GreyFrom(image).value_or(cv::Mat());
}

// Pixels of each encoding that are (10, 200, 30) in colour, or 77.
TEST(GreyFrom, KnowsGreyAndColourAndNoOthers) {
  const auto grey_of = [](const std::string& encoding, const std::vector<uint8_t>& pixel) {
    std::vector<std::byte> data;
    for (int i = 0; i < 16; ++i) {
      for (const uint8_t value : pixel) data.push_back(static_cast<std::byte>(value));
    }
    return static_cast<int>(GreyOf(encoding, 4, data).at<uchar>(2, 2));
  };
  EXPECT_EQ(grey_of("mono8", {77}), 77);
  EXPECT_EQ(grey_of("8UC1", {77}), 77);
  const int grey = grey_of("rgb8", {10, 200, 30});
  EXPECT_NEAR(grey, 0.299 * 10 + 0.587 * 200 + 0.114 * 30, 1);
  EXPECT_EQ(grey_of("bgr8", {30, 200, 10}), grey);
  EXPECT_EQ(grey_of("rgba8", {10, 200, 30, 255}), grey);
  EXPECT_EQ(grey_of("bgra8", {30, 200, 10, 255}), grey);
  EXPECT_EQ(grey_of("yuv422", {128, 77}), 77);
  EXPECT_EQ(grey_of("yuv422_yuy2", {77, 128}), 77);
  EXPECT_NEAR(grey_of("bayer_rggb8", {77}), 77, 1);
  EXPECT_TRUE(GreyOf("32FC1", 4, std::vector<std::byte>(64)).empty());
}

// Red, green and blue of a mosaic reach the weights that they have in grey.
TEST(GreyFrom, ReadsMosaicsInTheirOrder) {
  std::vector<std::byte> data(64);  // all red
  for (size_t y = 0; y < 8; y += 2) {
    for (size_t x = 0; x < 8; x += 2) data[8 * y + x] = static_cast<std::byte>(200);
  }
  EXPECT_NEAR(GreyOf("bayer_rggb8", 8, data).at<uchar>(4, 4), 0.299 * 200, 2);
}

TEST(GreyFrom, SixteenBitsAreAsTheMachineHasThem) {
  const std::vector<std::byte> data = {std::byte{0x12}, std::byte{0x34}};
  EXPECT_EQ(GreyOf("mono16", 1, data).at<uint16_t>(0), 0x3412);
  EXPECT_EQ(GreyOf("mono16", 1, data, true).at<uint16_t>(0), 0x1234);
}

TEST(GreyFrom, FewerPixelsThanTheSizeSaysAreDamage) {
  EXPECT_THROW(GreyOf("mono8", 4, std::vector<std::byte>(15)), DataError);
}

}  // namespace
}  // namespace slcmap
