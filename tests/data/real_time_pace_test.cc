#include <gtest/gtest.h>

#include <algorithm>

#include "data/source/sequence_source.h"

namespace slcmap {
namespace {

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

}  // namespace
}  // namespace slcmap
