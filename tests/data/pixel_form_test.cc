#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "data/io/image.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using testing::TempFolder;

class PixelFormTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const cv::Mat& image) {
    cv::imwrite(folder_.Path(name), image);
    return folder_.Path(name);
  }

  // A 16-bit image whose values are those of an 8-bit one, times 2^shift.
  std::string WriteDeep(const std::string& name, int shift) {
    cv::Mat deep;
    testing::Texture(1, 0).convertTo(deep, CV_16U, 1 << shift);
    return Write(name, deep);
  }

  TempFolder folder_;
};

TEST_F(PixelFormTest, ReadsTheBitsThatAreThere) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    const std::string path = WriteDeep("a.png", bits - 8);
    Warnings warnings;
    const auto forms = FindPixelForms({{{path}, {path}}}, &warnings);
    EXPECT_EQ(forms[0].bits, bits);
    EXPECT_EQ(forms[1].bits, bits);
    EXPECT_EQ(warnings.Count(kImageFewBits), bits == 16 ? 0 : 2);
    const cv::Mat image = ReadGrayImage(path, {}, forms[0]).image;
    EXPECT_EQ(cv::norm(image, testing::Texture(1, 0), cv::NORM_INF), 0);
  }
}

TEST_F(PixelFormTest, OneBrightImageTellsForBothCameras) {
  const std::string dark = WriteDeep("dark.png", 4), bright = WriteDeep("bright.png", 8);
  Warnings warnings;
  EXPECT_EQ(FindPixelForms({{{dark, dark, bright}, {dark}}}, &warnings)[1].bits, 16);
  EXPECT_TRUE(warnings.entries().empty());
}

TEST_F(PixelFormTest, TellsAMosaicAndTakesItsMean) {
  const cv::Mat gray = testing::Texture(2, 0);
  EXPECT_FALSE(FindPixelForms({{{Write("gray.png", gray)}, {}}})[0].mosaic);
  for (const bool green_first : {false, true}) {
    cv::Mat mosaic = gray.clone();
    for (int y = 0; y < gray.rows; ++y) {
      for (int x = 0; x < gray.cols; ++x) {
        const bool green = ((x + y) % 2 == 0) == green_first;
        mosaic.at<uchar>(y, x) =
            cv::saturate_cast<uchar>(gray.at<uchar>(y, x) * (green        ? 1
                                                             : y % 2 == 0 ? 0.5
                                                                          : 0.7));
      }
    }
    const std::string path = Write("mosaic.png", mosaic);
    const PixelForm form = FindPixelForms({{{path}, {}}})[0];
    EXPECT_TRUE(form.mosaic);
    EXPECT_FALSE(
        FindPixelForms({{{Write("plain.png", ReadGrayImage(path, {}, form).image)}, {}}})[0]
            .mosaic);
  }
}

TEST_F(PixelFormTest, ReadsFilesWithBytesBehindTheirEnd) {
  for (const char* name : {"a.jpg", "a.png"}) {
    const std::string path = Write(name, testing::Texture(3, 0));
    const std::string whole = testing::ReadText(path);
    const cv::Mat image = ReadGrayImage(path, {}).image;
    for (const std::string& rest :
         {std::string(3, '\0'), std::string(900, '\xff'), std::string("\xff\xd8 and more")}) {
      std::ofstream(path, std::ios::binary) << whole << rest;
      EXPECT_EQ(FindImageProblem(path, {}), nullptr);
      const ImageRead read = ReadGrayImage(path, {});
      ASSERT_EQ(read.problem, nullptr) << name;
      EXPECT_EQ(cv::norm(read.image, image, cv::NORM_INF), 0);
    }
    std::ofstream(path, std::ios::binary)
        << whole.substr(0, whole.size() * 3 / 4) << std::string(64, '\0');
    EXPECT_STREQ(FindImageProblem(path, {}), kImageTruncated);
    EXPECT_STREQ(ReadGrayImage(path, {}).problem, kImageTruncated);
  }
}

// A JPEG with EXIF data that ask for a turn by 90 degrees.
TEST_F(PixelFormTest, TakesPixelsAsStored) {
  const std::string path = Write("a.jpg", testing::Texture(4, 0));
  const std::string whole = testing::ReadText(path);
  const std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01"
      "\0\x06\0\0\0\0\0\0",
      36);
  std::ofstream(path, std::ios::binary) << whole.substr(0, 2) << exif << whole.substr(2);
  Warnings warnings;
  FindPixelForms({{{path}, {}}}, &warnings);
  EXPECT_EQ(warnings.Count(kImageOrientation), 1);
  EXPECT_EQ(ReadGrayImage(path, {96, 64}).problem, nullptr);
}

}  // namespace
}  // namespace slcmap
