#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "data/core/error.h"
#include "data/source/sequence.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int64_t kStart_ns = 1403636580000000000;

// 10 s of images at 20 Hz and IMU samples at 100 Hz, whose clock is 2 s ahead of the images'.
Sequence MakeSequence() {
  Sequence sequence;
  sequence.rig.camera_time_offset_s = 2;
  for (int i = 0; i <= 200; ++i) {
    sequence.images.push_back({kStart_ns + i * int64_t{50000000}, "l", "r"});
  }
  for (int i = 0; i <= 1400; ++i) {
    ImuSample sample;
    sample.stamp_ns = kStart_ns + i * int64_t{10000000};
    sequence.imu.push_back(sample);
  }
  return sequence;
}

TEST(SequencePart, KeepsTheImagesOfItsTimeAndTheSamplesAroundThem) {
  Sequence sequence = MakeSequence();
  KeepPart({3, 2.5}, &sequence);
  ASSERT_EQ(sequence.images.size(), 51u);
  EXPECT_EQ(sequence.images.front().stamp_ns, kStart_ns + 3000000000);
  EXPECT_EQ(sequence.images.back().stamp_ns, kStart_ns + 5500000000);
  EXPECT_EQ(sequence.imu.front().stamp_ns, kStart_ns + 4000000000);
  EXPECT_EQ(sequence.imu.back().stamp_ns, kStart_ns + 8500000000);
}

TEST(SequencePart, IsAllByDefaultAndGoesToTheEndWithoutADuration) {
  Sequence sequence = MakeSequence();
  KeepPart({}, &sequence);
  EXPECT_EQ(sequence.images.size(), 201u);
  EXPECT_EQ(sequence.imu.size(), 1401u);
  KeepPart({9.5, 0}, &sequence);
  EXPECT_EQ(sequence.images.size(), 11u);
  EXPECT_EQ(sequence.images.back().stamp_ns, kStart_ns + 10000000000);
}

TEST(SequencePart, TimesThatCannotBeAreNamed) {
  Sequence sequence = MakeSequence();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double time_s : {-1.0, 1e300, nan}) {
    EXPECT_THAT(
        [&] {
          KeepPart({time_s, 0}, &sequence);
        },
        ThrowsMessage<ConfigError>(HasSubstr("--from: found")));
    EXPECT_THAT(
        [&] {
          KeepPart({0, time_s}, &sequence);
        },
        ThrowsMessage<ConfigError>(HasSubstr("--duration: found")));
  }
  EXPECT_THAT(
      [&] {
        KeepPart({11, 5}, &sequence);
      },
      ThrowsMessage<ConfigError>(HasSubstr("expected a part of the recording's 10.000 s")));
}

}  // namespace
}  // namespace slcmap
