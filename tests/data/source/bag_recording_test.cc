// A recording is the same, and opens the same, in a folder and in any bag.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "data/bag/messages.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/convert_recording.h"
#include "data/source/recorded_source.h"
#include "data/source/sequence_options_json.h"
#include "tests/data/bag/made_bag.h"
#include "tests/testing/caught.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::BagCase;
using ::testing::HasSubstr;
using testing::ImageStamp;
using testing::MessageOf;
using testing::TempFolder;

constexpr int kPairs = 12;

// A small recording in a folder, and what is made of it.
class BagRecording : public ::testing::Test {
 protected:
  BagRecording() { testing::WriteSequence(folder_, {.images = kPairs}); }

  std::string Asl() const { return folder_.Path("mav0"); }

  SequenceOptions WithCalibration() const {
    SequenceOptions options;
    options.calibration = Asl();
    return options;
  }

  std::string MakeBag(const BagPacking& packing, bool keep_files = false,
                      const SequencePart& part = {}) {
    const std::string path =
        folder_.Path("walk" + std::string(packing.form == "db3" ? "" : "." + packing.form));
    fs::remove_all(path);
    counts_ = WriteBagRecording(*OpenTables(Asl(), {}), part, packing, keep_files, path, {});
    return path;
  }

  std::string MakeFolderOf(const std::string& bag) {
    const std::string path = folder_.Path("back/mav0");
    fs::remove_all(path);
    SequenceOptions options;
    options.needs_imu = false;
    counts_ = WriteAslRecording(*OpenTables(bag, options), {}, path, {});
    return path;
  }

  // Writes the tables of so many images anew, with other stamps.
  template <typename Moved>
  void MoveTables(int images, const Moved& moved_ns) {
    std::string rows = kAslImagesHead, imu = kAslImuHead;
    for (int i = 0; i < images; ++i) {
      rows += fmt::format("{},{}.png\n", moved_ns(ImageStamp(i)), ImageStamp(i));
    }
    const int64_t last_ns = ImageStamp(images);
    for (int64_t t = ImageStamp(0) - 20'000'000; t <= last_ns; t += testing::kImuStep_ns) {
      imu += testing::ImuRow(moved_ns(t)) + "\n";
    }
    for (const char* camera : {"/cam0", "/cam1"}) WriteFile(Asl() + camera + "/data.csv", rows);
    WriteFile(Asl() + "/imu0/data.csv", imu);
  }

  TempFolder folder_;
  ConvertedCounts counts_;
};

void ExpectSameImage(const Sequence& a, const std::string& path_a, const Sequence& b,
                     const std::string& path_b, int camera) {
  EXPECT_EQ(PathWithin(path_a, a.folder), PathWithin(path_b, b.folder));
  const auto at = static_cast<size_t>(camera);
  const ImageRead one = ReadGrayImage(*a.store, path_a, {}, a.pixel_forms[at]);
  const ImageRead other = ReadGrayImage(*b.store, path_b, {}, b.pixel_forms[at]);
  ASSERT_STREQ(one.problem, other.problem) << path_a;
  if (one.problem != nullptr) return;
  ASSERT_EQ(one.image.size(), other.image.size()) << path_a;
  EXPECT_EQ(cv::norm(one.image, other.image, cv::NORM_INF), 0) << path_a;
}

// To the bit, apart from where it is.
void ExpectSame(const Sequence& a, const Sequence& b) {
  ASSERT_EQ(a.images.size(), b.images.size());
  for (size_t i = 0; i < a.images.size(); ++i) {
    EXPECT_EQ(a.images[i].stamp_ns, b.images[i].stamp_ns);
    ExpectSameImage(a, a.images[i].left_path, b, b.images[i].left_path, 0);
    if (a.images[i].right_path.empty()) continue;
    ExpectSameImage(a, a.images[i].right_path, b, b.images[i].right_path, 1);
  }
  ASSERT_EQ(a.imu.size(), b.imu.size());
  for (size_t i = 0; i < a.imu.size(); ++i) {
    EXPECT_EQ(a.imu[i].stamp_ns, b.imu[i].stamp_ns);
    EXPECT_EQ(a.imu[i].angular_velocity_rad_s, b.imu[i].angular_velocity_rad_s);
    EXPECT_EQ(a.imu[i].specific_force_m_s2, b.imu[i].specific_force_m_s2);
  }
}

class EveryBag : public BagRecording, public ::testing::WithParamInterface<BagCase> {};

TEST_P(EveryBag, OpensAsTheFolderDoesAndBecomesOneAgain) {
  const Sequence folder = OpenSequence(Asl());
  for (const bool keep_files : {false, true}) {
    const std::string bag = MakeBag({GetParam().form, GetParam().compression}, keep_files);
    EXPECT_EQ(counts_.rows["cam1"], kPairs);
    const Sequence opened = OpenSequence(bag, WithCalibration());
    ExpectSame(folder, opened);
    EXPECT_TRUE(opened.warnings.entries().empty());
    EXPECT_NE(opened.form, folder.form);
    const std::string back = MakeFolderOf(bag);
    EXPECT_TRUE(counts_.warnings.entries().empty());
    ExpectSame(folder, OpenSequence(back, WithCalibration()));
    if (keep_files) {
      const std::string name = "/cam0/data/" + std::to_string(ImageStamp(3)) + ".png";
      EXPECT_EQ(ReadFile(back + name), ReadFile(Asl() + name));
    }
  }
}

// Of each form; bag/bag_test has all compressions.
INSTANTIATE_TEST_SUITE_P(All, EveryBag,
                         ::testing::Values(BagCase{"bag", "lz4", BagEncoding::kRos1},
                                           BagCase{"db3", "zstd", BagEncoding::kCdr},
                                           BagCase{"mcap", "zstd", BagEncoding::kRos1}),
                         [](const auto& test) {
                           return std::string(test.param.form) + "_" + test.param.compression;
                         });

TEST_F(BagRecording, IsOpenedAgainAsItWas) {
  const std::string bag = MakeBag({"mcap", "lz4"});
  const Sequence opened = OpenSequence(bag, WithCalibration());
  EXPECT_EQ(opened.opened.topics, "left=/cam0/image_raw,right=/cam1/image_raw,imu=/imu0");
  const SequenceOptions read = ParseOpened({{"opened", OpenedJson(opened.opened)}});
  EXPECT_EQ(read.topics, opened.opened.topics);
  const auto again = OpenAgain(bag, read, "");
  EXPECT_EQ(again->info().pair_stamps_ns.size(), static_cast<size_t>(kPairs));
  EXPECT_EQ(again->ReadImage(4, 1).problem, nullptr);
  // Of the folder that was made of it, too.
  EXPECT_EQ(OpenAgain(Asl(), read, "")->ReadImage(4, 1).problem, nullptr);
  EXPECT_THAT(MessageOf<ConfigError>([&] { OpenSequence(Asl(), read); }), HasSubstr("--topics"));
  SequenceOptions swapped = WithCalibration();
  swapped.topics = "left=/cam1/image_raw,right=/cam0/image_raw";
  const Sequence other = OpenSequence(bag, swapped);
  EXPECT_EQ(cv::norm(other.store->Read(other.images[2].left_path).pixels,
                     opened.store->Read(opened.images[2].right_path).pixels, cv::NORM_INF),
            0);
}

TEST_F(BagRecording, WithoutACalibrationSaysHowToGiveIt) {
  const std::string bag = MakeBag({"bag", "none"});
  const auto fault = testing::Caught<InputFault>([&] { OpenSequence(bag); });
  EXPECT_THAT(fault.what(), HasSubstr("/cam0/image_raw"));
  EXPECT_THAT(fault.remedy(), HasSubstr("--calibration"));
}

TEST_F(BagRecording, ListsItsTopicsWithWhatTheyAreTakenAs) {
  const std::string bag = MakeBag({"bag", "bz2"});
  const std::vector<RecordedTopic> topics = ListRecordedTopics(bag, "");
  ASSERT_EQ(topics.size(), 3u);
  EXPECT_EQ(topics[1].taken_as, "right images");
  EXPECT_EQ(topics[1].messages, kPairs);
  EXPECT_EQ(topics[2].taken_as, "gyroscope and accelerometer");
  EXPECT_TRUE(ListRecordedTopics(Asl(), "").empty());
}

TEST_F(BagRecording, APartOfItIsConverted) {
  const std::string bag = MakeBag({"mcap", "zstd"}, false, {.from_s = 0.1, .duration_s = 0.25});
  const Sequence part = OpenSequence(bag, WithCalibration());
  ASSERT_EQ(part.images.size(), 6u);
  EXPECT_EQ(part.images.front().stamp_ns, ImageStamp(2));
  Sequence cut = OpenSequence(Asl());
  KeepPart({.from_s = 0.1, .duration_s = 0.25}, &cut);
  ExpectSame(cut, part);
  EXPECT_THROW(MakeBag({"mcap", "zstd"}, false, {.from_s = 100}), ConfigError);
}

TEST_F(BagRecording, SixteenBitsStay) {
  for (int i = 0; i < kPairs; ++i) {
    for (const char* camera : {"cam0", "cam1"}) {
      cv::Mat deep;
      testing::Texture(i, 0).convertTo(deep, CV_16U, 4);
      WritePng(fmt::format("{}/{}/data/{}.png", Asl(), camera, ImageStamp(i)), deep);
    }
  }
  const Sequence folder = OpenSequence(Asl());
  EXPECT_EQ(folder.pixel_forms[0].bits, 10);
  const Sequence bag = OpenSequence(MakeBag({"db3", "none"}), WithCalibration());
  EXPECT_EQ(bag.pixel_forms[0].bits, 10);
  ExpectSame(folder, bag);
}

Warnings ReadThrough(const Sequence& sequence, size_t* pairs) {
  RecordedSource source(sequence);
  for (*pairs = 0; source.NextPair(std::numeric_limits<int64_t>::min()); ++*pairs) {
  }
  return source.warnings();
}

TEST_F(BagRecording, CountsDamagedImagesAsTheFolderDoes) {
  const std::string cut = fmt::format("{}/cam0/data/{}.png", Asl(), ImageStamp(4));
  const std::string whole = ReadFile(cut);
  WriteFile(cut, std::string_view(whole).substr(0, whole.size() / 2));
  WritePng(fmt::format("{}/cam1/data/{}.png", Asl(), ImageStamp(7)), cv::Mat1b(8, 8, uchar{9}));
  const Sequence bag = OpenSequence(MakeBag({"bag", "lz4"}, true), WithCalibration());
  size_t pairs = 0;
  const Warnings warnings = ReadThrough(bag, &pairs);
  EXPECT_EQ(pairs, static_cast<size_t>(kPairs - 2));
  EXPECT_EQ(warnings.Count(kImageTruncated), 1);
  EXPECT_EQ(warnings.Count(kImageWrongSize), 1);
  const RecordedSource source(bag);
  EXPECT_STREQ(source.FindProblem(4, 0), kImageTruncated);
  EXPECT_STREQ(source.FindProblem(7, 1), kImageWrongSize);
  EXPECT_EQ(source.FindProblem(5, 0), nullptr);
  // As pixels they are not written at all.
  MakeBag({"bag", "lz4"});
  EXPECT_EQ(counts_.warnings.Count(kImageUndecodable), 1);
  EXPECT_EQ(counts_.rows["cam0"], kPairs - 1);
}

TEST_F(BagRecording, CountsImagesWithFewerPixelsThanTheySayAndEmptyOnes) {
  const std::function<void(RosImage*)> kFaults[] = {[](RosImage* image) { image->height_px += 1; },
                                                    [](RosImage* image) { *image = {}; }};
  for (const auto& spoil : kFaults) {
    std::vector<testing::BagMessage> messages =
        testing::MadeMessages(BagEncoding::kRos1, kPairs, 64);
    const auto spoilt = std::ranges::find(messages, "/cam0/image_raw", &testing::BagMessage::topic);
    auto image = DecodeMessage<RosImage>(BagEncoding::kRos1, spoilt->bytes);
    spoil(&image);
    const auto changed = EncodeMessage(BagEncoding::kRos1, image);
    spoilt->bytes = changed;
    const TempFolder folder;
    Warnings warnings;
    EXPECT_EQ(OpenTables(testing::MakeBag(folder, testing::kBagCases[0], messages), {})
                  ->ReadImages(0, &warnings)
                  .elements.size(),
              static_cast<size_t>(kPairs - 1));
    EXPECT_EQ(warnings.Count(kMessageUnreadable), 1);
  }
}

// Before its calibration, which lacks the IMU's frame then, too.
TEST_F(BagRecording, WithoutAnImuSaysWhatIsThere) {
  const std::string path = folder_.Path("blind.mcap");
  const auto writer = CreateBag(path, {"mcap", "none"});
  const std::vector<std::byte> pixels(64);
  RosImage image;
  image.width_px = image.height_px = image.step_bytes = 8;
  image.encoding = "mono8";
  image.data.bytes = pixels;
  writer->Write(writer->AddTopic({"/image", RosImage::kType, BagEncoding::kCdr, "cdr"}), 0,
                EncodeMessage(BagEncoding::kCdr, image));
  writer->Close();
  EXPECT_THAT(MessageOf<InputFault>([&] { OpenSequence(path); }),
              AllOf(HasSubstr("found no topic of an IMU"), HasSubstr("/image (")));
  SequenceOptions without;
  without.needs_imu = false;
  EXPECT_THAT(MessageOf<InputFault>([&] { OpenSequence(path, without); }),
              HasSubstr("no topic of an IMU; missing is "));
}

// Topics of their own, whose messages come in bursts, one topic before the other.
TEST_F(BagRecording, GyroscopeAndAccelerometerMayHaveTopicsOfTheirOwn) {
  const std::string path = folder_.Path("apart.mcap");
  const auto writer = CreateBag(path, {"mcap", "none"});
  const auto add = [&](const char* name, const char* type) {
    return writer->AddTopic({name, type, BagEncoding::kCdr, "cdr"});
  };
  const uint32_t image_topic = add("/image", RosImage::kType);
  const uint32_t gyro_topic = add("/gyro", RosImu::kType);
  const uint32_t accel_topic = add("/accel", RosImu::kType);
  const std::vector<std::byte> pixels(64);
  constexpr int kBursts = 20, kGyros = 20, kAccels = 10;
  for (int burst = 0; burst < kBursts; ++burst) {
    const int64_t start_ns = ImageStamp(2 * burst);
    const auto put = [&](uint32_t topic, int count, double value) {
      for (int i = 0; i < count; ++i) {
        RosImu imu;
        imu.stamp_ns = start_ns + 100'000'000 * i / count + static_cast<int64_t>(value);
        imu.angular_velocity_rad_s = {value, 0.1 * i, 0};
        imu.linear_acceleration_m_s2 = {value, 0, 9.81};
        writer->Write(topic, start_ns + 100'000'000, EncodeMessage(BagEncoding::kCdr, imu));
      }
    };
    put(accel_topic, kAccels, 2);
    put(gyro_topic, kGyros, 3);
    RosImage image;
    image.stamp_ns = start_ns;
    image.width_px = image.height_px = image.step_bytes = 8;
    image.encoding = "mono8";
    image.data.bytes = pixels;
    writer->Write(image_topic, start_ns, EncodeMessage(BagEncoding::kCdr, image));
  }
  writer->Close();
  Warnings warnings;
  const auto tables = OpenTables(path, {});
  const std::vector<ImuSample> samples = TakeSamples(tables->ReadImu(&warnings), &warnings);
  EXPECT_EQ(warnings.Count(kStampUnsorted) + warnings.Count(kRowUnreadable), 0);
  EXPECT_GE(samples.size(), static_cast<size_t>(kBursts * kGyros - 10)) << "but for the ends";
  EXPECT_EQ(samples[5].angular_velocity_rad_s.x(), 3);
  EXPECT_EQ(samples[5].specific_force_m_s2.x(), 2);
  // There and back: rows that lack a half stay apart.
  const std::string back = folder_.Path("apart/mav0");
  WriteAslRecording(*tables, {}, back, {});
  const std::vector<ImuSample> read = ReadAslImu(back + "/imu0/data.csv", &warnings);
  ASSERT_EQ(read.size(), samples.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].stamp_ns, samples[i].stamp_ns);
    EXPECT_EQ(read[i].specific_force_m_s2, samples[i].specific_force_m_s2);
  }
  const std::string again = folder_.Path("again.bag");
  WriteBagRecording(*OpenTables(back, {}), {}, {"bag", "none"}, false, again, {});
  EXPECT_EQ(OpenTables(again, {})->topics(),
            "left=/cam0/image_raw,gyro=/imu0/gyro,accel=/imu0/accel");
  EXPECT_EQ(TakeSamples(OpenTables(again, {})->ReadImu(&warnings), &warnings).size(),
            samples.size());
}

// Files of a split bag that overlap: what is in two of them is taken once.
TEST_F(BagRecording, OfOverlappingFilesEachMessageIsTakenOnce) {
  fs::create_directories(folder_.Path("split"));
  const auto write = [&](const char* name, const SequencePart& part) {
    fs::rename(MakeBag({"bag", "none"}, false, part), folder_.Path(std::string("split/") + name));
  };
  write("walk_0.bag", {.from_s = 0, .duration_s = 0.3});
  write("walk_1.bag", {.from_s = 0.2});
  const Sequence whole = OpenSequence(Asl());
  const Sequence split = OpenSequence(folder_.Path("split"), WithCalibration());
  ExpectSame(whole, split);
  EXPECT_EQ(split.warnings.Count(kStampUnsorted), 0);
  EXPECT_GE(split.warnings.Count(kMessageTwice), 6);
  const std::string back = MakeFolderOf(folder_.Path("split"));
  EXPECT_EQ(counts_.rows["cam0"], kPairs);
  EXPECT_EQ(counts_.warnings.Count(kMessageTwice), split.warnings.Count(kMessageTwice));
}

// As logs of videos have them, which begin at 0.
TEST_F(BagRecording, SamplesBeforeTimeZeroAreLeftOut) {
  MoveTables(kPairs, [](int64_t stamp_ns) { return stamp_ns - ImageStamp(0); });
  const Sequence bag = OpenSequence(MakeBag({"mcap", "none"}), WithCalibration());
  EXPECT_EQ(counts_.warnings.Count("samples_before_time_zero"), 4);
  EXPECT_EQ(bag.images.size(), static_cast<size_t>(kPairs));
  EXPECT_EQ(bag.imu.front().stamp_ns, 0);
}

// Rows stay in the order in which they were written: what tells of a clock that was set back.
TEST_F(BagRecording, AClockThatWasSetBackIsPutRightAsOfTheFolder) {
  constexpr int kMany = 40;
  fs::remove_all(Asl());
  testing::WriteSequence(folder_, {.images = kMany, .still = true});
  MoveTables(kMany, [](int64_t stamp_ns) {
    return stamp_ns - (stamp_ns >= ImageStamp(20) ? 5'000'000'000 : 0);
  });
  const Sequence folder = OpenSequence(Asl());
  EXPECT_EQ(folder.images.size(), static_cast<size_t>(kMany));
  const Sequence bag = OpenSequence(MakeBag({"bag", "none"}), WithCalibration());
  ASSERT_EQ(bag.images.size(), folder.images.size());
  for (size_t i = 0; i < bag.images.size(); ++i) {
    EXPECT_EQ(bag.images[i].stamp_ns, folder.images[i].stamp_ns);
  }
  ASSERT_EQ(bag.imu.size(), folder.imu.size());
  EXPECT_EQ(bag.imu.back().stamp_ns, folder.imu.back().stamp_ns);
  EXPECT_EQ(bag.warnings.Count(kClockJump), folder.warnings.Count(kClockJump));
}

// What a process has in memory now, in bytes.
int64_t MemoryInUse() {
  std::ifstream file("/proc/self/statm");
  int64_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * 4096;
}

// 160 MB of images, packed and not.
TEST_F(BagRecording, IsReadInBoundedMemory) {
  constexpr uint32_t kSize_px = 1000;
  constexpr int kImages = 160;
  for (const char* compression : {"none", "lz4"}) {
    const std::string path = folder_.Path("large.bag");
    const auto writer = CreateBag(path, {"bag", compression});
    const uint32_t topic =
        writer->AddTopic({"/image", RosImage::kType, BagEncoding::kRos1, "ros1"});
    const std::vector<std::byte> pixels(size_t{kSize_px} * kSize_px);
    for (int i = 0; i < kImages; ++i) {
      RosImage image;
      image.stamp_ns = ImageStamp(i);
      image.width_px = image.height_px = image.step_bytes = kSize_px;
      image.encoding = "mono8";
      image.data.bytes = pixels;
      writer->Write(topic, image.stamp_ns, EncodeMessage(BagEncoding::kRos1, image));
    }
    writer->Close();
    const int64_t before = MemoryInUse();
    int64_t most = before;
    SequenceOptions options;
    options.needs_imu = false;
    const auto tables = OpenTables(path, options);
    Warnings warnings;
    for (const ImageFile& file : tables->ReadImages(0, &warnings).elements) {
      EXPECT_FALSE(tables->images()->Read(file.path).pixels.empty());
      most = std::max(most, MemoryInUse());
    }
    EXPECT_LT(most - before, 40'000'000) << compression;
    fs::remove(path);
  }
}

}  // namespace
}  // namespace slcmap
