#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/io/image.h"
#include "data/source/asl_source.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using testing::TempFolder;

namespace fs = std::filesystem;

class StereoReaderTest : public ::testing::Test {
 protected:
  StereoReaderTest() { testing::WriteSequence(folder_, {.images = 12}); }

  std::string Image(int camera, int index) const {
    return folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(index)));
  }

  // The indices of the pairs that are given out.
  std::vector<int> ReadAll(const StereoReaderOptions& options = {}) {
    const Sequence sequence = OpenSequence(folder_.Path());
    StereoReader reader(sequence, options);
    std::vector<int> indices;
    while (const auto pair = reader.Next()) {
      const int index =
          static_cast<int>((pair->stamp_ns - testing::kFirstStamp_ns) / testing::kImageStep_ns);
      EXPECT_EQ(cv::norm(pair->left, testing::Texture(index, 0), cv::NORM_INF), 0);
      if (options.read_right) {
        EXPECT_EQ(cv::norm(pair->decode_right(), testing::Texture(index, 4), cv::NORM_INF), 0);
      } else {
        EXPECT_FALSE(pair->decode_right);
      }
      indices.push_back(index);
    }
    warnings_ = reader.warnings();
    return indices;
  }

  TempFolder folder_;
  Warnings warnings_;
};

TEST_F(StereoReaderTest, GivesAllPairsInOrder) {
  EXPECT_THAT(ReadAll(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_THAT(ReadAll({.read_right = false, .read_ahead = 1}),
              ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_TRUE(warnings_.entries().empty());
}

TEST_F(StereoReaderTest, LeavesOutWhatCannotBeReadAndCountsIt) {
  fs::remove(Image(0, 1));
  fs::resize_file(Image(1, 3), fs::file_size(Image(1, 3)) / 2);
  cv::imwrite(Image(0, 5), cv::Mat(64, 95, CV_8U, cv::Scalar(7)));
  std::ofstream(Image(1, 7)) << "this is no image";
  std::ofstream(Image(0, 9)).close();
  std::string damaged = testing::ReadText(Image(0, 11));
  damaged[damaged.size() / 2] ^= 0x55;
  std::ofstream(Image(0, 11), std::ios::binary) << damaged;
  EXPECT_THAT(ReadAll(), ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_EQ(warnings_.Count(kImageMissing), 1);
  EXPECT_EQ(warnings_.Count(kImageTruncated), 2);
  EXPECT_EQ(warnings_.Count(kImageWrongSize), 1);
  EXPECT_EQ(warnings_.Count(kImageUndecodable), 2);
}

TEST_F(StereoReaderTest, GivesNoRightImageWhosePixelsAreDamaged) {
  std::string damaged = testing::ReadText(Image(1, 0));
  damaged[damaged.size() / 2] ^= 0x55;
  std::ofstream(Image(1, 0), std::ios::binary) << damaged;
  const Sequence sequence = OpenSequence(folder_.Path());
  StereoReader reader(sequence);
  const auto pair = reader.Next();
  ASSERT_TRUE(pair.has_value());
  EXPECT_TRUE(pair->decode_right().empty());
}

TEST_F(StereoReaderTest, PassesOverPairsBeforeAStamp) {
  fs::remove(Image(0, 3));
  fs::remove(Image(0, 8));
  const Sequence sequence = OpenSequence(folder_.Path());
  for (const int read_ahead : {1, 20}) {
    StereoReader reader(sequence, {.read_ahead = read_ahead});
    EXPECT_EQ(reader.Next()->stamp_ns, testing::ImageStamp(0));
    EXPECT_EQ(reader.Next(testing::ImageStamp(5))->stamp_ns, testing::ImageStamp(5));
    EXPECT_EQ(reader.Next()->stamp_ns, testing::ImageStamp(6));
    EXPECT_EQ(reader.Next(testing::ImageStamp(8))->stamp_ns, testing::ImageStamp(9));
    EXPECT_EQ(reader.warnings().Count(kImageMissing), 1);
    EXPECT_FALSE(reader.Next(testing::ImageStamp(12)).has_value());
    EXPECT_FALSE(reader.Next().has_value());
  }
}

TEST_F(StereoReaderTest, EndsCleanlyHalfWay) {
  const Sequence sequence = OpenSequence(folder_.Path());
  StereoReader reader(sequence, {.read_ahead = 2});
  EXPECT_TRUE(reader.Next().has_value());
}

TEST(ReadGrayImage, SixteenBitsLoseTheirLowerByte) {
  const TempFolder folder;
  cv::Mat deep(4, 5, CV_16U, cv::Scalar(0x12ff));
  cv::imwrite(folder.Path("a.png"), deep);
  const ImageRead read = ReadGrayImage(folder.Path("a.png"), cv::Size(5, 4));
  ASSERT_EQ(read.problem, nullptr);
  EXPECT_EQ(read.image.type(), CV_8U);
  EXPECT_EQ(read.image.at<uchar>(2, 2), 0x12);
}

}  // namespace
}  // namespace slcmap
