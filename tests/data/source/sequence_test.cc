#include "data/source/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <tuple>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/source/asl_files.h"
#include "data/source/recorded_source.h"
#include "data/source/sequence_options_json.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ImageStamp;
using testing::MessageOf;
using testing::TempFolder;

// A small sequence in a folder of its own.
class Recorded : public TempFolder {
 public:
  explicit Recorded(int images, bool still = false) {
    testing::WriteSequence(*this, {.images = images, .still = still});
  }

  Sequence Open(const SequenceOptions& options = {}) const { return OpenSequence(Path(), options); }
  std::string Message() const {
    return MessageOf<DataError>([&] { Open(); });
  }
};

const char* const kTables[] = {"mav0/cam0/data.csv", "mav0/cam1/data.csv", "mav0/imu0/data.csv"};

TEST(OpenSequence, TakesTheFolderTheOneAboveAndBothLineEnds) {
  for (const char* end : {"\n", "\r\n"}) {
    const TempFolder folder;
    testing::WriteSequence(folder, {.images = 5, .line_end = end});
    for (const char* name : {"", "mav0"}) {
      const Sequence sequence = OpenSequence(folder.Path(name));
      ASSERT_EQ(sequence.images.size(), 5u);
      EXPECT_EQ(sequence.images[4].stamp_ns, ImageStamp(4));
      EXPECT_TRUE(fs::exists(sequence.images[4].right_path)) << sequence.images[4].right_path;
      EXPECT_EQ(sequence.imu.size(), 55u);
      EXPECT_DOUBLE_EQ(sequence.imu[3].specific_force_m_s2.z(), 9.81);
      EXPECT_TRUE(sequence.warnings.entries().empty());
      EXPECT_EQ(sequence.truth_path, "");
    }
  }
}

TEST(OpenSequence, FindsImagesWithoutOrWithOtherFileColumns) {
  const Recorded folder(2);
  const std::string stamp = std::to_string(ImageStamp(0)), left = stamp + ".png";
  for (const auto& [cam0, cam1] :
       {std::pair<std::string, std::string>{"", ",cam1/data/" + left + ",exposure,3"},
        {", ./data/" + left, "," + folder.Path("mav0/cam1/data/") + left}}) {
    folder.Write("mav0/cam0/data.csv", stamp + cam0 + "\n");
    folder.Write("mav0/cam1/data.csv", stamp + cam1 + "\n");
    const Sequence sequence = folder.Open();
    EXPECT_TRUE(fs::exists(sequence.images[0].left_path)) << cam0;
    EXPECT_TRUE(fs::exists(sequence.images[0].right_path)) << cam1;
  }
}

// cam0 looks aside, cam1 and cam2 ahead, cam3 is calibrated but was not recorded.
class SequenceOfMany : public ::testing::Test {
 protected:
  SequenceOfMany() {
    testing::WriteSequence(folder_, {.images = 5});
    fs::copy(folder_.Path("mav0/cam1"), folder_.Path("mav0/cam2"), fs::copy_options::recursive);
    std::string chain;
    const char* kAhead = "[0, 0, 1, {}], [-1, 0, 0, {}], [0, -1, 0, 0], [0, 0, 0, 1]";
    const char* kAside = "[1, 0, 0, {}], [0, 0, 1, {}], [0, -1, 0, 0], [0, 0, 0, 1]";
    for (int i = 0; i < 4; ++i) {
      fs::remove(folder_.Path(fmt::format("mav0/cam{}/sensor.yaml", i)));
      chain += fmt::format(
          "cam{}:\n  camera_model: pinhole\n  intrinsics: [{}, 60, 47.5, 31.5]\n"
          "  distortion_model: none\n  resolution: [96, 64]\n  T_imu_cam: [{}]\n",
          i, 60 + i, fmt::format(fmt::runtime(i == 0 ? kAside : kAhead), 0, -0.1 * i));
    }
    folder_.Write("camchain.yaml", chain +
                                       "imu0:\n  update_rate: 200\n"
                                       "  gyroscope_noise_density: 1.7e-4\n"
                                       "  gyroscope_random_walk: 2e-5\n"
                                       "  accelerometer_noise_density: 2e-3\n"
                                       "  accelerometer_random_walk: 3e-3\n");
    options_.calibration = folder_.Path("camchain.yaml");
  }

  const TempFolder folder_;
  SequenceOptions options_;
};

TEST_F(SequenceOfMany, AllThatWereRecordedAreTakenTheBestPairFirst) {
  const Sequence sequence = OpenSequence(folder_.Path(), options_);
  EXPECT_THAT(sequence.cameras, ElementsAre(1, 2, 0));
  EXPECT_EQ(CameraCount(sequence.rig), 3);
  EXPECT_THAT(sequence.CameraNames(), ElementsAre("cam1", "cam2", "cam0"));
  EXPECT_THAT(sequence.images[0].path(2), HasSubstr("/cam0/"));
  EXPECT_EQ(sequence.rig.cameras[1].fx_px, 62);
  EXPECT_THAT(sequence.images[0].left_path, HasSubstr("/cam1/"));
  EXPECT_THAT(sequence.images[0].right_path, HasSubstr("/cam2/"));
  EXPECT_THAT(sequence.calibration_source, HasSubstr("cameras 1, 2, 0 of 4"));
}

TEST_F(SequenceOfMany, ThoseThatAreNamedAreTakenOrMissed) {
  options_.cameras = {2, 0};
  EXPECT_THAT(OpenSequence(folder_.Path(), options_).images[0].left_path, HasSubstr("/cam2/"));
  options_.cameras = {2};
  const Sequence one = OpenSequence(folder_.Path(), options_);
  EXPECT_FALSE(IsStereo(one.rig));
  EXPECT_THAT(one.images[0].left_path, HasSubstr("/cam2/"));
  options_.cameras = {2, 3};
  EXPECT_THAT(MessageOf<DataError>([&] { OpenSequence(folder_.Path(), options_); }),
              HasSubstr("--cameras: found no cam3 in"));
}

TEST_F(SequenceOfMany, OfThoseThatWereRecordedTwoAreTakenThoughTheyLookApart) {
  fs::remove_all(folder_.Path("mav0/cam1"));
  const Sequence sequence = OpenSequence(folder_.Path(), options_);
  EXPECT_THAT(sequence.cameras, ElementsAre(0, 2));
}

TEST(OpenSequence, ACameraThatIsNotWantedMayBeMalformed) {
  const Recorded folder(4);
  folder.Write("mav0/cam2/sensor.yaml", "intrinsics: [1, 2\n  xx");
  EXPECT_THAT(folder.Message(), HasSubstr("cam2"));
  SequenceOptions options;
  options.cameras = {0, 1};
  EXPECT_TRUE(IsStereo(folder.Open(options).rig));
}

// A map's calibration names the cameras that were used cam0 and cam1.
TEST_F(SequenceOfMany, IsOpenedAgainAsItWas) {
  options_.cameras = {1, 2};
  options_.right_offset_s = 1e-4;
  Sequence sequence = OpenSequence(folder_.Path(), options_);
  EXPECT_THAT(sequence.opened.cameras, ElementsAre(1, 2));
  EXPECT_EQ(sequence.opened.right_offset_s, 1e-4);
  sequence.rig.cameras[0].fx_px = 77;
  WriteKalibrCalibration(folder_.Path("calibration.yaml"), sequence.rig);
  const auto source = OpenAgain(folder_.Path(), sequence.opened, folder_.Path("calibration.yaml"));
  EXPECT_EQ(source->info().rig.cameras[0].fx_px, 77);
  EXPECT_EQ(source->info().rig.cameras[1].fx_px, 62);
  EXPECT_THAT(source->ImagePlace(0, 0), HasSubstr("/cam1/"));
  EXPECT_THAT(source->ImagePlace(0, 1), HasSubstr("/cam2/"));
  EXPECT_EQ(OpenAgain(folder_.Path(), sequence.opened, "")->info().rig.cameras[0].fx_px, 61);
  EXPECT_THAT(MessageOf<DataError>([&] { OpenAgain(folder_.Path(), {}, ""); }),
              HasSubstr("found more than two cameras, and a map by an earlier version"));
}

// The calibration that was named may be gone: the map has it.
TEST(OpenAgain, TakesTheCalibrationOfTheMap) {
  const Recorded folder(3);
  Sequence sequence = folder.Open();
  EXPECT_THAT(sequence.opened.cameras, ElementsAre(0, 1));
  sequence.rig.cameras[0].fx_px = 77;
  WriteKalibrCalibration(folder.Path("calibration.yaml"), sequence.rig);
  sequence.opened.calibration = folder.Path("gone.yaml");
  sequence.opened.masks = {folder.Path("gone.png")};
  const auto source = OpenAgain(folder.Path(), sequence.opened, folder.Path("calibration.yaml"));
  EXPECT_EQ(source->info().rig.cameras[0].fx_px, 77);
}

// What stamps and calibration tell of when right images are taken adds up, once.
TEST(OpenAgain, RightImagesAreTakenAsLateAsTheyWere) {
  const Recorded folder(20);
  std::string rows = "#timestamp [ns],filename\n";
  for (int i = 0; i < 20; ++i) {
    rows += fmt::format("{},{}.png\n", ImageStamp(i) + 4'000'000, ImageStamp(i));
  }
  folder.Write("mav0/cam1/data.csv", rows);
  folder.Write("mav0/cam1/sensor.yaml", testing::SensorYaml(-0.1) + "timeshift_cam_imu: 0.003\n");
  const Sequence sequence = folder.Open();
  EXPECT_NEAR(sequence.rig.right_time_offset_s, 0.007, 1e-9);
  const SequenceOptions opened = ParseOpened({{"opened", OpenedJson(sequence.opened)}});
  WriteKalibrCalibration(folder.Path("calibration.yaml"), WithoutStamps(sequence.rig, opened));
  const auto source = OpenAgain(folder.Path(), opened, folder.Path("calibration.yaml"));
  EXPECT_NEAR(source->info().rig.right_time_offset_s, 0.007, 1e-9);
}

// Of a run whose check paired images anew, see data/check/intervals.h.
TEST(OpenAgain, TakesThePairsThatWereMended) {
  const Recorded folder(12);
  SequenceOptions opened = folder.Open().opened;
  opened.pieces = {{ImageStamp(1), ImageStamp(3), 0, 0, true},
                   {ImageStamp(5), ImageStamp(6), -1, 1, true},
                   {ImageStamp(8), ImageStamp(9), 0, 0, false}};
  const auto source = OpenAgain(folder.Path(), opened, "");
  const auto stamp = [](int i) { return std::to_string(ImageStamp(i)); };
  EXPECT_THAT(source->info().pair_stamps_ns,
              ElementsAre(ImageStamp(1), ImageStamp(2), ImageStamp(3), ImageStamp(6), ImageStamp(7),
                          ImageStamp(8), ImageStamp(9)));
  EXPECT_THAT(source->ImagePlace(2, 1), HasSubstr(stamp(3)));
  EXPECT_THAT(source->ImagePlace(3, 0), HasSubstr(stamp(5)));
  EXPECT_THAT(source->ImagePlace(3, 1), HasSubstr(stamp(4)));
  EXPECT_THAT(source->ImagePlace(6, 0), HasSubstr(stamp(9)));
  EXPECT_EQ(source->ImagePlace(6, 1), "");
}

// Moves the stamps of a table back from `from_ns` on, and leaves out its row of that stamp.
void SetBack(const TempFolder& folder, const std::string& name, int64_t from_ns, int64_t back_ns) {
  std::istringstream text(testing::ReadText(folder.Path(name)));
  std::string rows;
  for (std::string row; std::getline(text, row);) {
    const int64_t stamp_ns = row[0] == '#' ? 0 : std::stoll(row);
    if (stamp_ns == from_ns) continue;
    const int64_t by_ns = stamp_ns < from_ns ? 0 : back_ns;
    rows += by_ns == 0 ? row : std::to_string(stamp_ns - by_ns) + row.substr(row.find(','));
    rows += "\n";
  }
  folder.Write(name, rows);
}

// A lost image makes its step another one than the samples'.
TEST(OpenSequence, AClockIsSetBackByAsMuchWithoutTheSamples) {
  const Recorded folder(40);
  for (const char* name : kTables) SetBack(folder, name, ImageStamp(20), 3'012'300'000);
  const Sequence with = folder.Open();
  SequenceOptions options;
  options.needs_imu = false;
  const Sequence without = folder.Open(options);
  EXPECT_TRUE(without.imu.empty());
  ASSERT_EQ(with.images.size(), 39u);
  ASSERT_EQ(without.images.size(), 39u);
  for (size_t i = 0; i < with.images.size(); ++i) {
    EXPECT_EQ(with.images[i].stamp_ns, without.images[i].stamp_ns) << i;
  }
  const int64_t across_ns = without.images[20].stamp_ns - without.images[19].stamp_ns;
  EXPECT_LT(std::abs(across_ns - 2 * testing::kImageStep_ns), 6'000'000);
}

// Whether samples are left out behind the change says whether a new segment begins.
TEST(OpenSequence, TheOtherCamerasStampsTellWhereOneIsSet) {
  const auto opened = [](const std::vector<int>& cameras, int64_t back_ns, int64_t late_ns = 0) {
    const Recorded folder(60, true);
    for (const int camera : {0, 1}) {
      std::string rows;
      const bool is_set = std::ranges::count(cameras, camera) > 0;
      for (int i = 0; i < 60; ++i) {
        const int64_t set_ns = is_set && i >= 30 ? back_ns : 0;
        rows +=
            fmt::format("{},{}.png\n", ImageStamp(i) + camera * late_ns - set_ns, ImageStamp(i));
      }
      folder.Write(fmt::format("mav0/cam{}/data.csv", camera), rows);
    }
    SequenceOptions options;
    if (late_ns != 0) options.right_offset_s = 1e-9 * static_cast<double>(late_ns);
    return folder.Open(options);
  };
  const size_t samples = opened({}, 0).imu.size();
  for (const auto& [cameras, back_ns] : {std::pair{std::vector{0}, 1'000'000'000LL},
                                         {{1}, 1'000'000'000LL},
                                         {{1}, 200'000'000LL},
                                         {{0}, -3'000'000'000LL},
                                         {{1}, -3'000'000'000LL}}) {
    const Sequence sequence = opened(cameras, back_ns);
    ASSERT_EQ(sequence.images.size(), 60u) << back_ns;
    for (int i = 0; i < 60; ++i) EXPECT_EQ(sequence.images[i].stamp_ns, ImageStamp(i));
    EXPECT_EQ(sequence.imu.size(), samples);
    EXPECT_EQ(sequence.warnings.Count(kClockJump), 1);
  }
  EXPECT_LT(opened({0, 1}, 1'000'000'000).imu.size(), samples);
  for (const int camera : {0, 1}) {
    const Sequence late = opened({camera}, 1'000'000'000, 10'000'000);
    ASSERT_EQ(late.images.size(), 60u) << camera;
    EXPECT_EQ(late.images[50].stamp_ns, ImageStamp(50)) << camera;
  }
}

TEST(OpenSequence, NoNoiseIsAssumedOfAnImuThatIsNotAskedFor) {
  const Recorded folder(4);
  std::filesystem::remove(folder.Path("mav0/imu0/sensor.yaml"));
  EXPECT_EQ(folder.Open().warnings.Count(kImuNoiseAssumed), 1);
  std::filesystem::remove_all(folder.Path("mav0/imu0"));
  SequenceOptions options;
  options.needs_imu = false;
  EXPECT_EQ(folder.Open(options).warnings.Count(kImuNoiseAssumed), 0);
}

TEST(OpenSequence, BadRowsAreCountedAndDropped) {
  const Recorded folder(4);
  const std::string imu = testing::ReadText(folder.Path("mav0/imu0/data.csv"));
  const int64_t after = ImageStamp(4) + testing::kImuStep_ns;
  folder.Write("mav0/imu0/data.csv", imu + std::to_string(after) + ",nan,0,0,0,0,9.81\n" +
                                         testing::ImuRow(ImageStamp(1)) + "\n" + "what,is,this\n" +
                                         testing::ImuRow(ImageStamp(4)) + "\n" +
                                         testing::ImuRow(after + testing::kImuStep_ns) + "\n");
  const Sequence sequence = folder.Open();
  EXPECT_EQ(sequence.imu.size(), 51u - 5u);
  EXPECT_EQ(sequence.warnings.Count(kRowNotFinite), 1);
  EXPECT_EQ(sequence.warnings.Count(kRowUnreadable), 1);
  EXPECT_EQ(sequence.warnings.Count(kStampUnsorted), 2);
  EXPECT_EQ(sequence.warnings.Count(kImuGap), 0);
  EXPECT_THAT(sequence.warnings.entries().at(kRowNotFinite).first_place,
              HasSubstr("imu0/data.csv: row 47"));
  const int64_t late_ns = ImageStamp(4) + 10 * testing::kImuStep_ns;
  folder.Write("mav0/imu0/data.csv", imu + testing::ImuRow(late_ns) + "\n");
  EXPECT_EQ(folder.Open().warnings.Count(kImuGap), 1);
}

// The rows of a file in an order that only its seed decides.
void Shuffle(const TempFolder& folder, const std::string& name) {
  std::istringstream text(testing::ReadText(folder.Path(name)));
  std::vector<std::string> rows;
  for (std::string row; std::getline(text, row);) {
    if (row[0] != '#') rows.push_back(row);
  }
  for (size_t i = 0; i < rows.size(); ++i) std::swap(rows[i], rows[i * 7919 % rows.size()]);
  std::string shuffled;
  for (const std::string& row : rows) shuffled += row + "\n";
  folder.Write(name, shuffled);
}

TEST(OpenSequence, ShuffledRowsAreSortedAndCounted) {
  const Recorded folder(12);
  const Sequence sorted = folder.Open();
  for (const char* name : kTables) Shuffle(folder, name);
  const Sequence sequence = folder.Open();
  ASSERT_EQ(sequence.images.size(), 12u);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(sequence.images[i].left_path, sorted.images[i].left_path);
    EXPECT_EQ(sequence.images[i].right_path, sorted.images[i].right_path);
  }
  ASSERT_EQ(sequence.imu.size(), sorted.imu.size());
  EXPECT_EQ(sequence.imu[5].stamp_ns, sorted.imu[5].stamp_ns);
  EXPECT_GT(sequence.warnings.Count(kRowSorted), 40);
  EXPECT_EQ(sequence.warnings.Count(kStampUnsorted), 0);
  EXPECT_EQ(sequence.warnings.Count(kImuGap), 0);
}

TEST(OpenSequence, StampsInAnotherUnitAreNamed) {
  const Recorded folder(12, true);
  for (const auto& [name, scale, unit] : {std::tuple{"imu0", 1'000'000'000, "seconds"},
                                          {"cam1", 1'000'000, "milliseconds"},
                                          {"cam0", 1'000, "microseconds"}}) {
    std::string rows;
    for (int i = 0; i < 12; ++i) {
      const int64_t stamp_ns = ImageStamp(i);
      rows += fmt::format("{}.{:09},0,0,0,0,0,9.81\n", stamp_ns / scale, stamp_ns % scale);
    }
    folder.Write(std::string("mav0/") + name + "/data.csv", rows);
    EXPECT_THAT(folder.Message(),
                AllOf(HasSubstr(std::string(name) + "/data.csv: found stamps that seem to be in "),
                      HasSubstr(unit)));
  }
}

TEST(OpenSequence, HugeStampsAndZeroBytesCostTheirRowOnly) {
  const Recorded folder(4);
  const std::string list = folder.Path("mav0/cam0/data.csv");
  folder.Write("mav0/cam0/data.csv", "-9223372036854775000,a.png\n" + testing::ReadText(list) +
                                         "9223372036854775000,b.png\n" +
                                         std::to_string(ImageStamp(5)) + ",c" +
                                         std::string(1, '\0') + ".png\n");
  const Sequence sequence = folder.Open();
  EXPECT_EQ(sequence.images.size(), 4u);
  EXPECT_EQ(sequence.warnings.Count(kRowUnreadable), 3);
}

TEST(OpenSequence, ImuTablesOfOtherColumnsOrClocksAreErrors) {
  const Recorded folder(4);
  const std::string imu = "mav0/imu0/data.csv", samples = testing::ReadText(folder.Path(imu));
  folder.Write(imu, "#timestamp [ns],a_x [m s^-2],a_y,a_z,w_x [rad s^-1],w_y,w_z\n" + samples);
  EXPECT_THAT(folder.Message(),
              HasSubstr("imu0/data.csv: row 1: found the columns 'a_x [m s^-2]', ..., 'w_x"));
  folder.Write(imu, testing::ImuRow(1000) + "\n" + testing::ImuRow(2000) + "\n");
  EXPECT_THAT(folder.Message(), HasSubstr("expected them to overlap"));
}

TEST(OpenSequence, LoopsOfLinksAreErrorsThatNameThePlace) {
  const Recorded folder(2);
  fs::remove(folder.Path("mav0/cam0/data.csv"));
  fs::create_symlink("data.csv", folder.Path("mav0/cam0/data.csv"));
  EXPECT_THAT(folder.Message(), HasSubstr("cam0/data.csv: cannot be opened"));
  fs::remove(folder.Path("mav0/cam0/sensor.yaml"));
  fs::create_symlink("sensor.yaml", folder.Path("mav0/cam0/sensor.yaml"));
  EXPECT_THAT(folder.Message(), HasSubstr("mav0"));
}

TEST(OpenSequence, ErrorsNameWhatIsMissing) {
  const TempFolder folder;
  const auto message = [&](const std::string& path) {
    return MessageOf<DataError>([&] { OpenSequence(path); });
  };
  EXPECT_THAT(message(folder.Path("none")), HasSubstr("none: found no such folder"));
  EXPECT_THAT(message(folder.Path()), HasSubstr("found neither cam0 nor mav0/cam0"));
  testing::WriteSequence(folder, {.images = 2});
  fs::rename(folder.Path("mav0/imu0"), folder.Path("mav0/imu1"));
  EXPECT_THAT(message(folder.Path()), HasSubstr("found no imu0"));
  fs::rename(folder.Path("mav0/imu1"), folder.Path("mav0/imu0"));
  folder.Write("mav0/cam0/data.csv", "#timestamp [ns],filename\n");
  EXPECT_THAT(message(folder.Path()), HasSubstr("cam0/data.csv: found no row of data"));
  fs::remove(folder.Path("mav0/cam0/data.csv"));
  EXPECT_THAT(message(folder.Path()), HasSubstr("cam0/data.csv: cannot be"));
  fs::remove(folder.Path("mav0/cam0/sensor.yaml"));
  EXPECT_THAT(message(folder.Path()), HasSubstr("found no calibration"));
}

TEST(OpenSequence, OneCameraIsARecordingToo) {
  const Recorded folder(4);
  fs::remove_all(folder.Path("mav0/cam1"));
  const Sequence sequence = folder.Open();
  EXPECT_FALSE(IsStereo(sequence.rig));
  ASSERT_EQ(sequence.images.size(), 4u);
  EXPECT_EQ(sequence.images[1].right_path, "");
  RecordedSource reader(sequence);
  const auto image = reader.NextPair();
  ASSERT_TRUE(image.has_value());
  EXPECT_FALSE(image->left.empty());
  EXPECT_TRUE(image->right.empty());
}

std::vector<ImageFile> Files(std::initializer_list<int64_t> stamps_ms) {
  std::vector<ImageFile> files;
  for (const int64_t stamp_ms : stamps_ms) {
    files.push_back({stamp_ms * 1000000, std::to_string(stamp_ms)});
  }
  return files;
}

TEST(PairImages, PairsByTimeAndCountsTheRest) {
  Warnings warnings;
  const auto pairs =
      PairImages(Files({0, 50, 100, 150, 300}), Files({1, 99, 101, 152, 200}), 0.003, &warnings);
  std::vector<std::string> found;
  for (const StereoEntry& pair : pairs) found.push_back(pair.left_path + "-" + pair.right_path);
  EXPECT_THAT(found, ElementsAre("0-1", "100-99", "150-152"));
  EXPECT_EQ(warnings.Count(kImageUnpaired), 4);
  EXPECT_EQ(PairImages(Files({10, 12}), Files({13}), 0.003, &warnings).at(0).left_path, "12");
}

TEST(LongestRising, OneAbsurdStampCostsOneRow) {
  EXPECT_THAT(LongestRising({1, 2, 900, 3, 4, 4, 5}), ElementsAre(0, 1, 3, 4, 6));
  EXPECT_THAT(LongestRising({5, 1, 2, 3}), ElementsAre(1, 2, 3));
  EXPECT_TRUE(LongestRising({}).empty());
}

}  // namespace
}  // namespace slcmap
