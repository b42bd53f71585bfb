#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "data/core/error.h"
#include "data/io/image.h"
#include "data/source/recorded_source.h"
#include "data/source/sequence.h"
#include "data/source/sequence_source.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

class RecordedPairs : public ::testing::Test {
 protected:
  RecordedPairs() { testing::WriteSequence(folder_, {.images = 12}); }

  std::string Image(int camera, int index) const {
    return folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(index)));
  }

  static void Damage(const std::string& path) {
    std::string bytes = testing::ReadText(path);
    bytes[bytes.size() / 2] ^= 0x55;
    std::ofstream(path, std::ios::binary) << bytes;
  }

  // The indices of the pairs that are given out.
  std::vector<int> ReadAll(const RecordedSourceOptions& options = {}) {
    const Sequence sequence = OpenSequence(folder_.Path());
    RecordedSource reader(sequence, options);
    std::vector<int> indices;
    while (const auto pair = reader.NextPair()) {
      const int index =
          static_cast<int>((pair->stamp_ns - testing::kFirstStamp_ns) / testing::kImageStep_ns);
      EXPECT_EQ(cv::norm(pair->left, testing::Texture(index, 0), cv::NORM_INF), 0);
      if (options.read_right) {
        EXPECT_EQ(cv::norm(pair->decode.at(0)(), testing::Texture(index, 4), cv::NORM_INF), 0);
      } else {
        EXPECT_TRUE(pair->decode.empty());
      }
      indices.push_back(index);
    }
    warnings_ = reader.warnings();
    return indices;
  }

  TempFolder folder_;
  Warnings warnings_;
};

TEST_F(RecordedPairs, GivesAllPairsInOrder) {
  EXPECT_THAT(ReadAll(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_THAT(ReadAll({.read_right = false, .read_ahead = 1}),
              ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_TRUE(warnings_.entries().empty());
}

TEST_F(RecordedPairs, LeavesOutWhatCannotBeReadAndCountsIt) {
  fs::remove(Image(0, 1));
  fs::resize_file(Image(1, 3), fs::file_size(Image(1, 3)) / 2);
  cv::imwrite(Image(0, 5), cv::Mat(64, 95, CV_8U, cv::Scalar(7)));
  std::ofstream(Image(1, 7)) << "this is no image";
  std::ofstream(Image(0, 9)).close();
  Damage(Image(0, 11));
  EXPECT_THAT(ReadAll(), ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_EQ(warnings_.Count(kImageMissing), 1);
  EXPECT_EQ(warnings_.Count(kImageTruncated), 2);
  EXPECT_EQ(warnings_.Count(kImageWrongSize), 1);
  EXPECT_EQ(warnings_.Count(kImageUndecodable), 2);
  // The right image is decoded later.
  Damage(Image(1, 0));
  const Sequence sequence = OpenSequence(folder_.Path());
  const auto pair = RecordedSource(sequence).NextPair();
  ASSERT_TRUE(pair.has_value());
  EXPECT_TRUE(pair->decode.at(0)().empty());
}

TEST_F(RecordedPairs, PassesOverPairsBeforeAStamp) {
  fs::remove(Image(0, 3));
  fs::remove(Image(0, 8));
  const Sequence sequence = OpenSequence(folder_.Path());
  for (const int read_ahead : {1, 20}) {
    RecordedSource reader(sequence, {.read_ahead = read_ahead});
    EXPECT_EQ(reader.NextPair()->stamp_ns, testing::ImageStamp(0));
    EXPECT_EQ(reader.NextPair(testing::ImageStamp(5))->stamp_ns, testing::ImageStamp(5));
    EXPECT_EQ(reader.NextPair()->stamp_ns, testing::ImageStamp(6));
    EXPECT_EQ(reader.NextPair(testing::ImageStamp(8))->stamp_ns, testing::ImageStamp(9));
    EXPECT_EQ(reader.warnings().Count(kImageMissing), 1);
    EXPECT_FALSE(reader.NextPair(testing::ImageStamp(12)).has_value());
    EXPECT_FALSE(reader.NextPair().has_value());
  }
}

TEST_F(RecordedPairs, EndsCleanlyHalfWay) {
  const Sequence sequence = OpenSequence(folder_.Path());
  RecordedSource reader(sequence, {.read_ahead = 2});
  EXPECT_TRUE(reader.NextPair().has_value());
}

constexpr int64_t kMs = 1'000'000, kFirst_ns = 1'403'636'580'000'000'000;

int64_t Stamp(int64_t ms) { return kFirst_ns + ms * kMs; }

// Images every 50 ms, and a clock that only the test and the waiting move.
class RealTimePaceTest : public ::testing::Test {
 protected:
  RealTimePaceTest()
      : pace_({Stamp(0), Stamp(50), Stamp(100), Stamp(150), Stamp(200), Stamp(250)},
              {[this] { return now_ns_; },
               [this](int64_t until_ns) { now_ns_ = std::max(now_ns_, until_ns); }}) {}

  // Takes the next image, on which work goes for some time; returns its stamp in ms.
  int64_t Work(int64_t work_ms) {
    const int64_t stamp_ns = pace_.Next();
    pace_.Take(stamp_ns);
    Pass(work_ms);
    pace_.Done(stamp_ns);
    return (stamp_ns - kFirst_ns) / kMs;
  }
  void Pass(int64_t ms) { now_ns_ += ms * kMs; }
  int64_t Now_ms() const { return (now_ns_ - kStart_ns) / kMs; }

  static constexpr int64_t kStart_ns = 77'000 * kMs;
  int64_t now_ns_ = kStart_ns;
  RealTimePace pace_;
};

TEST_F(RealTimePaceTest, WaitsUntilImagesAreDue) {
  EXPECT_EQ(Work(10), 0);
  EXPECT_EQ(Now_ms(), 10);
  EXPECT_FALSE(pace_.IsDue());
  EXPECT_EQ(Work(10), 50);
  EXPECT_EQ(Now_ms(), 60);
  for (const int64_t stamp_ms : {100, 150, 200, 250}) EXPECT_EQ(Work(30), stamp_ms);
  EXPECT_TRUE(pace_.AtEnd());
  EXPECT_FALSE(pace_.IsDue());
  EXPECT_EQ(pace_.Report().skipped_images, 0);
}

TEST_F(RealTimePaceTest, GoesOnWithTheNewestImageThatIsDue) {
  EXPECT_EQ(Work(49), 0);
  EXPECT_EQ(Work(50), 50);  // until the moment when the next is due
  EXPECT_TRUE(pace_.IsDue());
  EXPECT_EQ(Work(149), 100);
  EXPECT_EQ(pace_.Report().skipped_images, 0);
  EXPECT_EQ(Work(1), 200);  // at 249
  EXPECT_EQ(pace_.Report().skipped_images, 1);
  EXPECT_EQ(Work(1), 250);
  EXPECT_TRUE(pace_.AtEnd());
}

TEST_F(RealTimePaceTest, TheFirstImageIsNeverSkippedAndStartsTheClock) {
  Pass(1000);
  EXPECT_EQ(Work(5000), 0);
  EXPECT_EQ(Work(1), 250);
  EXPECT_EQ(pace_.Report().skipped_images, 4);
}

TEST_F(RealTimePaceTest, WaitsForTheImageThatIsTakenInPlaceOfOneThatCannotBeRead) {
  EXPECT_EQ(Work(1), 0);
  EXPECT_EQ(pace_.Next(), Stamp(50));
  pace_.Take(Stamp(150));
  EXPECT_EQ(Now_ms(), 150);
  EXPECT_EQ(Work(1), 200);
  EXPECT_EQ(pace_.Report().skipped_images, 0);
}

TEST_F(RealTimePaceTest, LatencyIsFromDueToDone) {
  EXPECT_EQ(pace_.Report().latency_median_s, 0);
  Work(10);
  Work(80);
  EXPECT_DOUBLE_EQ(pace_.Report().latency_median_s, 0.01);
  EXPECT_DOUBLE_EQ(pace_.Report().latency_95_s, 0.08);
  Work(10);  // due 30 ms ago
  EXPECT_DOUBLE_EQ(pace_.Report().latency_median_s, 0.04);
  for (int i = 0; i < 16; ++i) pace_.Done(Stamp(100));
  Pass(1000);
  pace_.Done(Stamp(100));
  EXPECT_DOUBLE_EQ(pace_.Report().latency_95_s, 0.08);
}

TEST(SteadyClock, ItsSleepEndsEarlyWhenAsked) {
  int asked = 0;
  const RealTimePace::Clock clock = SteadyClock([&] { return ++asked > 1; });
  const int64_t far_ns = clock.now_ns() + 3'600'000 * kMs;
  clock.sleep_until_ns(far_ns);
  EXPECT_EQ(asked, 2);
  EXPECT_LT(clock.now_ns(), far_ns);
  clock.sleep_until_ns(clock.now_ns());
  EXPECT_EQ(asked, 2);
}

// 10 s of images at 20 Hz and IMU samples at 100 Hz, whose clock is 2 s ahead of the images'.
Sequence MakeSequence() {
  Sequence sequence;
  sequence.rig.camera_time_offset_s = 2;
  for (int i = 0; i <= 200; ++i) {
    sequence.images.push_back({kFirst_ns + i * int64_t{50000000}, "l", "r"});
  }
  for (int i = 0; i <= 1400; ++i) {
    ImuSample sample;
    sample.stamp_ns = kFirst_ns + i * int64_t{10000000};
    sequence.imu.push_back(sample);
  }
  return sequence;
}

TEST(SequencePart, KeepsTheImagesOfItsTimeAndTheSamplesAroundThem) {
  Sequence sequence = MakeSequence();
  KeepPart({}, &sequence);  // all by default
  EXPECT_EQ(sequence.images.size(), 201u);
  EXPECT_EQ(sequence.imu.size(), 1401u);
  KeepPart({3, 2.5}, &sequence);
  ASSERT_EQ(sequence.images.size(), 51u);
  EXPECT_EQ(sequence.images.front().stamp_ns, kFirst_ns + 3000000000);
  EXPECT_EQ(sequence.images.back().stamp_ns, kFirst_ns + 5500000000);
  EXPECT_EQ(sequence.imu.front().stamp_ns, kFirst_ns + 4000000000);
  EXPECT_EQ(sequence.imu.back().stamp_ns, kFirst_ns + 8500000000);
  sequence = MakeSequence();
  KeepPart({9.5, 0}, &sequence);  // to the end without a duration
  EXPECT_EQ(sequence.images.size(), 11u);
  EXPECT_EQ(sequence.images.back().stamp_ns, kFirst_ns + 10000000000);
}

TEST(SequencePart, TimesThatCannotBeAreNamed) {
  Sequence sequence = MakeSequence();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [&](const SequencePart& part) {
    return MessageOf<ConfigError>([&] { KeepPart(part, &sequence); });
  };
  for (const double time_s : {-1.0, 1e300, nan}) {
    EXPECT_THAT(message({time_s, 0}), HasSubstr("--from: found"));
    EXPECT_THAT(message({0, time_s}), HasSubstr("--duration: found"));
  }
  EXPECT_THAT(message({11, 5}), HasSubstr("expected a part of the recording's 10.000 s"));
}

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
  const cv::Mat deep(4, 5, CV_16U, cv::Scalar(0x12ff));  // loses its lower byte
  EXPECT_EQ(ReadGrayImage(Write("deep.png", deep), {}).image.at<uchar>(2, 2), 0x12);
  for (const int bits : {8, 10, 12, 14, 16}) {
    const std::string path = WriteDeep("a.png", bits - 8);
    Warnings warnings;
    const auto forms = FindPixelForms(*FileImages(), {{path}, {path}}, &warnings);
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
  EXPECT_EQ(FindPixelForms(*FileImages(), {{dark, dark, bright}, {dark}}, &warnings)[1].bits, 16);
  EXPECT_TRUE(warnings.entries().empty());
}

TEST_F(PixelFormTest, TellsAMosaicAndTakesItsMean) {
  const cv::Mat gray = testing::Texture(2, 0);
  EXPECT_FALSE(FindPixelForms(*FileImages(), {{Write("gray.png", gray)}, {}})[0].mosaic);
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
    const PixelForm form = FindPixelForms(*FileImages(), {{path}, {}})[0];
    EXPECT_TRUE(form.mosaic);
    EXPECT_FALSE(FindPixelForms(*FileImages(),
                                {{Write("plain.png", ReadGrayImage(path, {}, form).image)}, {}})[0]
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
      EXPECT_EQ(FindImageProblem(path, {96, 64}), nullptr);
      EXPECT_STREQ(FindImageProblem(path, {64, 96}), kImageWrongSize);
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
  FindPixelForms(*FileImages(), {{path}, {}}, &warnings);
  EXPECT_EQ(warnings.Count(kImageOrientation), 1);
  EXPECT_EQ(ReadGrayImage(path, {96, 64}).problem, nullptr);
}

}  // namespace
}  // namespace slcmap
