#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap {
namespace {

TEST(MakeFrames, MakesEachFrameOnceAndReportsTheLast) {
  std::vector<std::atomic<int>> made(500);
  int reported = 0;
  const auto progress = [&](int done) {
    EXPECT_GE(done, reported);
    reported = done;
    return true;
  };
  EXPECT_EQ(MakeFrames(
                500, 3, [&](int i) { ++made[i]; }, progress),
            500);
  EXPECT_EQ(reported, 500);
  for (const auto& count : made) EXPECT_EQ(count, 1);
}

TEST(MakeFrames, StopsWithTheFirstFramesWhenAsked) {
  std::vector<std::atomic<int>> made(100'000);
  const auto make = [&](int i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ++made[i];
  };
  const int count = MakeFrames(100'000, 2, make, [](int done) { return done < 5; });
  EXPECT_GE(count, 5);
  EXPECT_LT(count, 10'000);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(made[i], i < count ? 1 : 0);
}

TEST(MakeFrames, PassesAnErrorOn) {
  const auto make = [](int i) {
    if (i == 7) throw OutputError("disk full");
  };
  EXPECT_THROW(MakeFrames(100, 2, make, [](int) { return true; }), OutputError);
}

TEST(MakeFrames, FramesThatWereStoppedDoNotCount) {
  const auto make = [](int i) {
    if (i >= 7) throw StoppedError("interrupted");
  };
  EXPECT_EQ(MakeFrames(100, 3, make, [](int) { return true; }), 7);
}

}  // namespace
}  // namespace slcmap
