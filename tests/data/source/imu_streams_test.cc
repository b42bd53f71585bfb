#include "data/source/imu_streams.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/source/asl_files.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TempFolder;

constexpr int64_t kImuStart_ns = 1403636579758555392, kStep_ns = 5000000;
constexpr int kCount = 1600;

// A hand-held motion: what the sensors read at a time.
Eigen::Vector3d GyroAt(double t_s) {
  return {0.3 * std::sin(2 * t_s), 0.2 * std::cos(3 * t_s), 0.1 + 0.2 * std::sin(t_s)};
}
Eigen::Vector3d AccelAt(double t_s) {
  return {std::sin(1.7 * t_s), 0.5 * std::cos(2.3 * t_s), 9.81 + 0.4 * std::sin(4 * t_s)};
}
double TimeOf(int i) { return 1e-9 * static_cast<double>(i) * kStep_ns; }

std::string Numbers(const Eigen::Vector3d& v) {
  return fmt::format("{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
}

int64_t StampOf(int i) { return kImuStart_ns + i * kStep_ns; }

// What `row` makes of each sample.
template <typename Row>
std::string Rows(const Row& row, int count = kCount) {
  std::string rows;
  for (int i = 0; i < count; ++i) rows += row(i);
  return rows;
}

std::string PlainRow(int64_t stamp_ns, int i) {
  return fmt::format("{},{},{}\n", stamp_ns, Numbers(GyroAt(TimeOf(i))),
                     Numbers(AccelAt(TimeOf(i))));
}

std::vector<ImuSample> Read(const std::string& rows, Warnings* warnings,
                            std::vector<ClockJump>* jumps = nullptr) {
  const TempFolder folder;
  return ReadAslImu(folder.Write("data.csv", "#timestamp [ns],wx,wy,wz,ax,ay,az\n" + rows),
                    warnings, jumps);
}

std::string FaultOf(const std::string& rows) {
  Warnings warnings;
  return testing::MessageOf<InputFault>([&] { Read(rows, &warnings); });
}

// Each sample is what the motion has at its stamp, late by `late_s`.
void ExpectOnTime(const std::vector<ImuSample>& samples, double late_s, double most_s) {
  for (size_t i = 50; i + 50 < samples.size(); ++i) {
    const double t_s = ToSeconds(samples[i].stamp_ns - kImuStart_ns) - late_s;
    EXPECT_LT((samples[i].angular_velocity_rad_s - GyroAt(t_s)).norm(), most_s) << i;
    EXPECT_LT((samples[i].specific_force_m_s2 - AccelAt(t_s)).norm(), 3 * most_s + 0.003) << i;
  }
}

// Gyroscope at every step, accelerometer after every third, with `blank` for the half that a row
// lacks.
std::string TwoStreams(const std::string& blank) {
  return Rows([&](int i) {
    const std::string gyro =
        fmt::format("{},{},{}\n", StampOf(i), Numbers(GyroAt(TimeOf(i))), blank);
    const std::string force = Numbers(AccelAt(TimeOf(i) + 0.0013));
    return i % 3 == 0 ? gyro + fmt::format("{},{},{}\n", StampOf(i) + 1300000, blank, force) : gyro;
  });
}

TEST(ImuStreams, RowsOfOneSensorAreJoined) {
  for (const char* blank : {"0,0,0", "0.0,-0.0,0", ",,", "nan,nan,nan", "NaN,NaN,NaN"}) {
    Warnings warnings;
    const std::vector<ImuSample> samples = Read(TwoStreams(blank), &warnings);
    EXPECT_GT(samples.size(), kCount - 8u) << blank;
    EXPECT_EQ(warnings.Count(kImuJoined), 1) << blank;
    EXPECT_THAT(warnings.entries().at(kImuJoined).first_place,
                HasSubstr("gyroscope at 200 Hz, accelerometer at 66.67 Hz"));
    EXPECT_EQ(warnings.entries().size(), 1u) << blank;
    ExpectOnTime(samples, 0, 1e-6);
  }
  // One after the other in the file too.
  const std::string apart =
      Rows([](int i) { return fmt::format("{},{}\n", StampOf(i), Numbers(GyroAt(TimeOf(i)))); }) +
      Rows([](int i) {
        return fmt::format("{},,,,{}\n", StampOf(i) + 700, Numbers(AccelAt(TimeOf(i))));
      });
  Warnings warnings;
  ExpectOnTime(Read(apart, &warnings), 0, 1e-5);
  EXPECT_EQ(warnings.Count(kImuJoined), 1);
  for (const int every : {2, 3, 4}) {  // a held half is renewed where it changes
    Warnings held;
    const std::string rows = Rows([&](int i) {
      return fmt::format("{},{},{}\n", StampOf(i), Numbers(GyroAt(TimeOf(i))),
                         Numbers(AccelAt(TimeOf(i / every * every))));
    });
    ExpectOnTime(Read(rows, &held), 0, 1e-6);
    EXPECT_EQ(held.Count(kImuJoined), 1) << every;
  }
}

TEST(ImuStreams, RepeatedSamplesAreLeftOut) {
  Warnings warnings;
  const std::vector<ImuSample> samples =
      Read(Rows([](int i) { return PlainRow(StampOf(i), i / 2 * 2); }), &warnings);
  EXPECT_EQ(samples.size(), kCount / 2u);
  EXPECT_EQ(warnings.Count(kImuRepeated), kCount / 2);
  EXPECT_EQ(warnings.Count(kImuJoined), 0);
}

// What `row` makes of each sample of a good recording, which must be taken as it is.
void ExpectUntouched(const std::function<std::string(int)>& row) {
  Warnings warnings;
  const std::vector<ImuSample> samples = Read(Rows(row), &warnings);
  EXPECT_EQ(samples.size(), static_cast<size_t>(kCount));
  EXPECT_TRUE(warnings.entries().empty()) << warnings.entries().begin()->first;
}

TEST(ImuStreams, GoodRecordingsThatLookAlikeAreNotAccused) {
  ExpectUntouched([&](int i) { return PlainRow(StampOf(i), i); });
  // At rest, without noise; and with a dead axis.
  ExpectUntouched([&](int i) { return fmt::format("{},0,0,0,0,0,9.81\n", StampOf(i)); });
  ExpectUntouched([&](int i) {
    return fmt::format("{},0,{:.4f},0,0,{:.4f},9.81\n", StampOf(i), GyroAt(TimeOf(i)).y(),
                       AccelAt(TimeOf(i)).y());
  });
  // Coarse readings at rest, which repeat as noise has it.
  std::mt19937 generator(3);
  for (const int codes : {2, 3, 8}) {
    ExpectUntouched([&](int i) {
      const auto code = [&] {
        return 0.01 * static_cast<double>(generator() % codes / (codes - 1));
      };
      return fmt::format("{},{},0,0,{},0,9.81\n", StampOf(i), code(), code());
    });
  }
  // Stamps of a host that is late by chance.
  ExpectUntouched([&](int i) { return PlainRow(StampOf(i) + generator() % 2000000, i); });
}

TEST(ImuStreams, SamplesInterpolatedAtImagesAreNoPackets) {
  Warnings warnings;
  const std::string rows = Rows([](int i) {
    const auto late_ns = static_cast<int64_t>((0.02 + 0.96 * (i % 50) / 50.0) * kStep_ns);
    const double t_s = TimeOf(i) + 1e-9 * static_cast<double>(late_ns);
    const std::string row = PlainRow(StampOf(i), i);
    return i % 4 == 1 ? row + fmt::format("{},{},{}\n", StampOf(i) + late_ns, Numbers(GyroAt(t_s)),
                                          Numbers(AccelAt(t_s)))
                      : row;
  });
  Read(rows, &warnings);
  EXPECT_TRUE(warnings.entries().empty()) << warnings.entries().begin()->first;
}

TEST(ImuStreams, ASensorTooSlowIsRefused) {
  const std::string rows =
      Rows([](int i) { return fmt::format("{},{},,,\n", StampOf(i), Numbers(GyroAt(TimeOf(i)))); });
  EXPECT_THAT(FaultOf(rows), HasSubstr("found 0 readings of the accelerometer"));
}

TEST(ImuStreams, RealRecordingsAreNotAccused) {
  for (const char* name : {"euroc_mh01_8s/mav0", "euroc_v1_01_imu", "room_mono_imu_15s/mav0"}) {
    const std::string folder = testing::SharedData(name);
    if (folder.empty()) GTEST_SKIP() << "no real recordings here";
    Warnings warnings;
    ReadAslImu(folder + "/imu0/data.csv", &warnings);
    EXPECT_TRUE(warnings.entries().empty()) << name << " " << warnings.entries().begin()->first;
  }
}

// Packets of `size`, the last sample late by 2 ms, the others `gap_ns` before it.
std::string Packets(int size, int64_t gap_ns, int lost = -1) {
  std::string rows;
  for (int first = 0; first + size <= kCount; first += size) {
    if (first / size == lost) continue;
    for (int k = 0; k < size; ++k) {
      const int64_t last_ns = kImuStart_ns + (first + size - 1) * kStep_ns + 2000000;
      rows += PlainRow(last_ns - (size - 1 - k) * gap_ns, first + k);
    }
  }
  return rows;
}

TEST(ImuStamps, PacketsThatAreStampedOnArrivalAreEvenedOut) {
  for (const int size : {2, 5, 8, 20}) {
    for (const int64_t gap_ns : {0, 15000, 300000}) {
      Warnings warnings;
      const std::vector<ImuSample> samples = Read(Packets(size, gap_ns), &warnings);
      EXPECT_EQ(samples.size(), static_cast<size_t>(kCount / size * size));
      EXPECT_EQ(warnings.Count(kImuOnArrival), 1) << size << " " << gap_ns;
      EXPECT_EQ(warnings.entries().size(), 1u) << size << " " << gap_ns;
      ExpectOnTime(samples, 0.002, 2e-4);
    }
  }
  Warnings lost;  // a lost packet leaves its gap
  ExpectOnTime(Read(Packets(8, 15000, 90), &lost), 0.002, 2e-4);
  EXPECT_EQ(lost.Count(kImuGap), 1);
}

TEST(ImuStamps, ADriftingClockIsFollowed) {
  std::vector<int64_t> stamps_ns;
  for (int i = 0; i < 20000; ++i) {
    const double drift = 1 + 3e-4 * std::sin(1e-4 * i);
    const int last = i / 8 * 8 + 7;
    stamps_ns.push_back(static_cast<int64_t>(last * 5e6 * drift) + (i % 8) * 20000);
  }
  const auto evened = EvenStamps(stamps_ns);
  ASSERT_TRUE(evened.has_value());
  for (int i = 0; i < 20000; ++i) {
    const double drift = 1 + 3e-4 * std::sin(1e-4 * i);
    EXPECT_NEAR(1e-9 * static_cast<double>(evened->stamps_ns[i]), 0.005 * i * drift, 3e-4) << i;
  }
}

TEST(ImuStamps, ASampleThatRepeatsAStampGetsItsOwn) {
  Warnings warnings;
  const std::vector<ImuSample> samples =
      Read(Rows([](int i) { return PlainRow(StampOf(i % 3 == 1 ? i - 1 : i), i); }), &warnings);
  EXPECT_EQ(samples.size(), static_cast<size_t>(kCount));
  EXPECT_EQ(warnings.Count(kImuStampsShared), 1);
  EXPECT_EQ(warnings.Count(kStampUnsorted), 0);
  ExpectOnTime(samples, 0, 1e-6);
}

// Of 300 samples, with stamps as a format has them.
std::string Written(const std::string& stamp_format) {
  const auto row = [&](int i) {
    return fmt::format(fmt::runtime(stamp_format + ",{},{}\n"), static_cast<double>(StampOf(i)),
                       Numbers(GyroAt(TimeOf(i))), Numbers(AccelAt(TimeOf(i))));
  };
  return Rows(row, 300);
}

TEST(LostDigits, AreNamedWhereTheyMatter) {
  Warnings warnings;
  EXPECT_EQ(Read(Written("{:.14E}"), &warnings).size(), 300u);
  EXPECT_EQ(warnings.Count(kStampDigits), 1);
  EXPECT_THAT(warnings.entries().at(kStampDigits).first_place, HasSubstr("steps of 10 us"));
  for (const char* format : {"{:.4E}", "{:.5E}", "{:.5e}", "{:.6g}", "{:.11e}"}) {
    EXPECT_THAT(FaultOf(Written(format)),
                AllOf(HasSubstr("found stamps that have lost digits ('1.4036"),
                      HasSubstr("expected whole nanoseconds")))
        << format;
  }
  Warnings all;
  EXPECT_EQ(Read(Written("{:.18e}"), &all).size(), 300u);
  EXPECT_TRUE(all.entries().empty());
}

TEST(DecimalCommas, AreNamed) {
  const auto with_commas = [](char separator, const std::string& quote) {
    const auto row = [&](int i) {
      std::string text = std::to_string(StampOf(i));
      for (const char* number : {"0,25", "-0,5", "0,125", "0,75", "-0,0625", "9,8125"}) {
        text += separator + quote + number + quote;
      }
      return text + "\n";
    };
    return Rows(row, 50);
  };
  for (const std::string& rows :
       {with_commas(';', ""), with_commas(',', "\""), with_commas(',', "")}) {
    EXPECT_THAT(FaultOf(rows), HasSubstr("found numbers with decimal commas"));
  }
}

TEST(TableText, MostRowsUnreadableIsAFaultThatShowsOne) {
  const auto row = [](int i) { return fmt::format("12:00:{:02},1,2,3,4,5,6\n", i); };
  EXPECT_THAT(FaultOf(Rows(row, 50)), AllOf(HasSubstr("found 50 of 50 rows that cannot be read"),
                                            HasSubstr("row 2: '12:00:00 | 1")));
}

// Clocks that go back half-way, of both sensors alike or of the accelerometer alone.
TEST(ImuStreams, AClockThatIsSetBackIsPutRightBeforeTheyAreJoined) {
  for (const auto& [gyro_back_ns, accel_back_ns] :
       {std::pair{3'000'000'000LL, 3'000'000'000LL}, {0LL, 3'001'000'000LL}}) {
    SCOPED_TRACE(gyro_back_ns);
    const std::string rows = Rows([&](int i) {
      const int64_t is_back = i < kCount / 2 ? 0 : 1;
      return fmt::format("{},{},,,\n{},,,,{}\n", StampOf(i) - is_back * gyro_back_ns,
                         Numbers(GyroAt(TimeOf(i))), StampOf(i) + 700'000 - is_back * accel_back_ns,
                         Numbers(AccelAt(TimeOf(i) + 0.0007)));
    });
    Warnings warnings;
    std::vector<ClockJump> jumps;
    const auto samples = Read(rows, &warnings, &jumps);
    if (gyro_back_ns > 0) {
      ASSERT_EQ(jumps.size(), 1u);
      EXPECT_EQ(jumps[0].back_ns, gyro_back_ns);
      EXPECT_GT(samples.size(), kCount - 3u);
    } else {
      EXPECT_TRUE(jumps.empty());
      EXPECT_EQ(warnings.Count(kClockJump), 1);
    }
    ExpectOnTime(samples, 0, 1e-4);
  }
}

TEST(ImuTables, NumbersThatLostTheirPointsOrDigitsAreNamed) {
  const std::string still = Numbers(GyroAt(0)) + "," + Numbers(AccelAt(0)) + "\n";
  const std::string pointless = Rows([](int i) {
    return fmt::format("{},-00984365698,01277581012,0037690000,81476550000,-03759000,-40860\n",
                       StampOf(i));
  });
  const auto rounded = [&](int i) { return fmt::format("{},{}", 1403636579 + i / 150, still); };
  // As a float of 32 bits keeps them.
  const auto as_float = [](int i) { return PlainRow(1403636620423364608, i); };
  EXPECT_THAT(FaultOf(pointless), HasSubstr("lost their decimal points"));
  EXPECT_THAT(FaultOf(Rows(rounded, 300)), HasSubstr("only 2 different stamps"));
  EXPECT_THAT(FaultOf(Rows(as_float, 300)),
              HasSubstr("found 300 rows with only 1 different stamps"));
}

constexpr int64_t kImageStep_ns = 50'000'000;

// Steps of 50 ms, and `back_ns` less from `row` on.
std::vector<int64_t> Stamps(size_t count, size_t row, int64_t back_ns) {
  std::vector<int64_t> stamps_ns;
  for (size_t i = 0; i < count; ++i) {
    stamps_ns.push_back(1'000'000'000'000 + static_cast<int64_t>(i) * kImageStep_ns -
                        (i < row ? 0 : back_ns));
  }
  return stamps_ns;
}

bool Never(size_t, size_t) { return false; }

TEST(FindClockJumps, FindsHowFarAClockIsSetBackOrForward) {
  for (const int64_t back_ns : {612'300'000LL, 3'012'300'000LL, 3'000'000'000LL, 100'000'000LL,
                                60'000'000'000LL, -20'000'000'000LL}) {
    const auto jumps = FindClockJumps(Stamps(160, 100, back_ns), Never);
    ASSERT_EQ(jumps.size(), 1u) << back_ns;
    EXPECT_EQ(jumps[0].row, 100u);
    EXPECT_EQ(jumps[0].back_ns, back_ns);
  }
}

TEST(FindClockJumps, TakesOtherDisorderForNone) {
  EXPECT_TRUE(FindClockJumps(Stamps(160, 160, 0), Never).empty());
  std::vector<int64_t> stamps_ns = Stamps(160, 160, 0);
  stamps_ns[40] -= 3'000'000'000;  // one damaged stamp
  std::swap(stamps_ns[90], stamps_ns[91]);
  EXPECT_TRUE(FindClockJumps(stamps_ns, Never).empty());
  stamps_ns = Stamps(160, 160, 0);
  std::rotate(stamps_ns.begin(), stamps_ns.begin() + 70, stamps_ns.end());  // halves swapped
  EXPECT_TRUE(FindClockJumps(stamps_ns, Never).empty());
  stamps_ns = Stamps(160, 160, 0);  // a block written twice
  const std::vector<int64_t> block(stamps_ns.begin() + 20, stamps_ns.begin() + 60);
  stamps_ns.insert(stamps_ns.begin() + 60, block.begin(), block.end());
  EXPECT_TRUE(FindClockJumps(stamps_ns, [](size_t, size_t) { return true; }).empty());
  stamps_ns = Stamps(150, 150, 0);  // blocks in the order A C B
  std::rotate(stamps_ns.begin() + 50, stamps_ns.begin() + 100, stamps_ns.end());
  EXPECT_TRUE(FindClockJumps(stamps_ns, Never).empty());
}

struct Stamped {
  int64_t stamp_ns;
};

std::vector<Stamped> Table(const std::vector<int64_t>& stamps_ns) {
  std::vector<Stamped> elements;
  for (const int64_t stamp_ns : stamps_ns) elements.push_back({stamp_ns});
  return elements;
}

std::vector<ClockJump> Restore(std::vector<Stamped>* elements) {
  return RestoreClock([](const Stamped&, const Stamped&) { return false; },
                      [](size_t) { return std::string(); }, elements);
}

TEST(ClockTables, OneThatIsSetForwardAndBackAgainIsPutRight) {
  for (const int64_t forward_ns : {10'000'000'000LL, 2'000'000'000LL, 700'000'000LL}) {
    std::vector<int64_t> stamps_ns = Stamps(160, 160, 0);
    for (size_t i = 40; i < 80; ++i) stamps_ns[i] += forward_ns;
    std::vector<Stamped> images = Table(stamps_ns), samples = Table(Stamps(160, 160, 0));
    std::vector<ClockJump> jumps = Restore(&images), none;
    ASSERT_EQ(jumps.size(), 2u) << forward_ns;
    EXPECT_EQ(jumps[0].row, 40u);
    EXPECT_EQ(jumps[1].row, 80u);
    ClockTable<Stamped> of_images{&images, &jumps};
    UndoForward(ClockTable<Stamped>{&samples, &none}, &of_images);
    LeaveOutPauses(none, &jumps);
    EXPECT_EQ(jumps.size(), 2u);
    for (size_t i = 0; i < images.size(); ++i) {
      EXPECT_EQ(images[i].stamp_ns, samples[i].stamp_ns) << i;
    }
  }
}

TEST(ClockTables, APauseOfOneTableIsNoJump) {
  for (const int64_t later_ns : {int64_t{0}, int64_t{1'000'000'000}}) {  // at the end
    std::vector<int64_t> stamps_ns = Stamps(160, 80, -1'000'000'000);
    if (later_ns == 0) stamps_ns.resize(140);
    std::vector<Stamped> images = Table(stamps_ns), samples = Table(Stamps(160, 160, 0));
    std::vector<ClockJump> jumps = Restore(&images), none;
    ASSERT_EQ(jumps.size(), 1u);
    ClockTable<Stamped> of_images{&images, &jumps}, of_samples{&samples, &none};
    UndoForward(of_samples, &of_images);
    LeaveOutPauses(none, &jumps);
    EXPECT_EQ(jumps.size(), later_ns == 0 ? 0u : 1u);
    EXPECT_EQ(images[100].stamp_ns - images[60].stamp_ns,
              40 * kImageStep_ns + (later_ns == 0 ? 1'000'000'000 : 0));
  }
}

}  // namespace
}  // namespace slcmap
