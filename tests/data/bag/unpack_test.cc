#include "data/bag/unpack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/source/asl_files.h"
#include "tests/data/bag/made_bag.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using testing::BagCase;
using testing::BagMessage;
using ::testing::HasSubstr;
using testing::TempFolder;

constexpr int kUnpackedPairs = 12;
constexpr uint32_t kUnpackedSize_px = 40;

class Unpacked : public ::testing::TestWithParam<BagCase> {};

TEST_P(Unpacked, FolderHoldsWhatTheBagHolds) {
  const TempFolder folder;
  const auto written = testing::MadeMessages(GetParam().encoding, kUnpackedPairs, kUnpackedSize_px);
  const auto bag = OpenBag(testing::MakeBag(folder, GetParam(), written));
  const RecordingTopics topics = {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"};
  const std::string out = folder.Path("out");
  const UnpackedCounts counts = UnpackRecording(topics, out, {}, bag.get());
  EXPECT_EQ(counts.left, kUnpackedPairs);
  EXPECT_EQ(counts.right, kUnpackedPairs);
  EXPECT_TRUE(counts.warnings.entries().empty());

  Warnings warnings;
  const std::vector<ImageFile> images = ReadAslImages(out + "/cam1", &warnings);
  const std::vector<ImuSample> samples = ReadAslImu(out + "/imu0/data.csv", &warnings);
  size_t image = 0, sample = 0;
  for (const BagMessage& message : written) {
    if (message.topic == "/cam1/image_raw") {
      const auto made = DecodeMessage<RosImage>(GetParam().encoding, message.bytes);
      ASSERT_LT(image, images.size());
      EXPECT_EQ(images[image].stamp_ns, made.stamp_ns);
      const cv::Mat read = cv::imread(images[image].path, cv::IMREAD_UNCHANGED);
      ASSERT_EQ(read.total(), made.data.bytes.size());
      EXPECT_TRUE(std::equal(made.data.bytes.begin(), made.data.bytes.end(),
                             reinterpret_cast<const std::byte*>(read.data)));
      ++image;
    } else if (message.topic == "/imu0") {
      const auto made = DecodeMessage<RosImu>(GetParam().encoding, message.bytes);
      ASSERT_LT(sample, samples.size());
      EXPECT_EQ(samples[sample].stamp_ns, made.stamp_ns);
      EXPECT_EQ(samples[sample].angular_velocity_rad_s.y(), made.angular_velocity_rad_s[1]);
      EXPECT_EQ(samples[sample].specific_force_m_s2.z(), made.linear_acceleration_m_s2[2]);
      ++sample;
    }
  }
  EXPECT_EQ(image, images.size());
  EXPECT_EQ(sample, samples.size());
}

INSTANTIATE_TEST_SUITE_P(All, Unpacked, ::testing::ValuesIn(testing::kBagCases),
                         [](const auto& test) {
                           return std::string(test.param.form) + "_" + test.param.compression;
                         });

// What a bag of one square image, with these bytes a row and in all, becomes.
cv::Mat UnpackImage(const std::string& encoding, uint32_t size_px, std::vector<std::byte> data) {
  const TempFolder folder;
  RosImage image;
  image.width_px = image.height_px = size_px;
  image.encoding = encoding;
  image.step_bytes = static_cast<uint32_t>(data.size()) / size_px;
  image.data.bytes = data;
  const auto writer = CreateBag(folder.Path("a.bag"), {"bag", "none"});
  const uint32_t topic = writer->AddTopic({"/image", RosImage::kType, BagEncoding::kRos1, ""});
  writer->Write(topic, 1, EncodeMessage(BagEncoding::kRos1, image));
  writer->Close();
  const auto bag = OpenBag(folder.Path("a.bag"));
  UnpackRecording({"/image", "", "/imu", "/imu"}, folder.Path("out"), {}, bag.get());
  return cv::imread(folder.Path("out/cam0/data/0.png"), cv::IMREAD_UNCHANGED);
}

// Pixels of each encoding that are (10, 200, 30) in colour, or 77.
TEST(Unpack, ImagesBecomeGreyAndOthersAreRefusedByName) {
  const auto unpack = [](const std::string& encoding, const std::vector<uint8_t>& pixel) {
    std::vector<std::byte> data;
    for (int i = 0; i < 16; ++i) {
      for (const uint8_t value : pixel) data.push_back(static_cast<std::byte>(value));
    }
    return static_cast<int>(UnpackImage(encoding, 4, data).at<uchar>(2, 2));
  };
  EXPECT_EQ(unpack("mono8", {77}), 77);
  EXPECT_EQ(unpack("8UC1", {77}), 77);
  const int grey = unpack("rgb8", {10, 200, 30});
  EXPECT_NEAR(grey, 0.299 * 10 + 0.587 * 200 + 0.114 * 30, 1);
  EXPECT_EQ(unpack("bgr8", {30, 200, 10}), grey);
  EXPECT_EQ(unpack("rgba8", {10, 200, 30, 255}), grey);
  EXPECT_EQ(unpack("bgra8", {30, 200, 10, 255}), grey);
  EXPECT_EQ(unpack("yuv422", {128, 77}), 77);
  EXPECT_EQ(unpack("yuv422_yuy2", {77, 128}), 77);
  EXPECT_NEAR(unpack("bayer_rggb8", {77}), 77, 1);
  EXPECT_THROW(unpack("32FC1", {0, 0, 0, 0}), InputFault);
}

// Red, green and blue of a mosaic reach the weights that they have in grey.
TEST(Unpack, MosaicsAreReadInTheirOrder) {
  std::vector<std::byte> data(64);  // all red
  for (size_t y = 0; y < 8; y += 2) {
    for (size_t x = 0; x < 8; x += 2) data[8 * y + x] = static_cast<std::byte>(200);
  }
  EXPECT_NEAR(UnpackImage("bayer_rggb8", 8, data).at<uchar>(4, 4), 0.299 * 200, 2);
}

TEST(Unpack, CompressedImagesStayAsTheyAreAndVideoIsRefused) {
  const TempFolder folder;
  cv::Mat1b pixels(6, 8, uchar{90});
  std::vector<uchar> jpeg;
  cv::imencode(".jpg", pixels, jpeg);
  const auto write = [&](const std::string& name, const std::vector<uchar>& bytes) {
    const auto writer = CreateBag(folder.Path(name), {"mcap", "zstd"});
    RosCompressedImage image;
    image.stamp_ns = 5;
    image.format = "h264";
    image.data.bytes = std::as_bytes(std::span(bytes));
    const uint32_t topic =
        writer->AddTopic({"/image", RosCompressedImage::kType, BagEncoding::kCdr, "cdr"});
    writer->Write(topic, 1, EncodeMessage(BagEncoding::kCdr, image));
    writer->Close();
    return OpenBag(folder.Path(name));
  };
  const auto bag = write("a.mcap", jpeg);
  UnpackRecording({"/image", "", "/imu", "/imu"}, folder.Path("out"), {}, bag.get());
  EXPECT_EQ(fs::file_size(folder.Path("out/cam0/data/5.jpg")), jpeg.size());
  const auto video = write("b.mcap", {0, 0, 0, 1, 0x67});
  try {
    UnpackRecording({"/image", "", "/imu", "/imu"}, folder.Path("out2"), {}, video.get());
    FAIL();
  } catch (const InputFault& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("'h264'"));
  }
}

}  // namespace
}  // namespace slcmap
