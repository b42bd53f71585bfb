#include <gtest/gtest.h>

#include "data/bag/messages.h"
#include "data/core/error.h"

namespace slcmap {
namespace {

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
