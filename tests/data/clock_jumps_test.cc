#include <gtest/gtest.h>

#include <algorithm>

#include "data/source/asl_files.h"

namespace slcmap {
namespace {

constexpr int64_t kStep_ns = 50'000'000;

// Steps of 50 ms, and `back_ns` less from `row` on.
std::vector<int64_t> Stamps(size_t count, size_t row, int64_t back_ns) {
  std::vector<int64_t> stamps_ns;
  for (size_t i = 0; i < count; ++i) {
    stamps_ns.push_back(1'000'000'000'000 + static_cast<int64_t>(i) * kStep_ns -
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
}

TEST(FindClockJumps, BlocksInAnyOrderAreNone) {
  const std::vector<int64_t> rising = Stamps(150, 150, 0);
  std::vector<int64_t> stamps_ns(rising.begin(), rising.begin() + 50);  // A C B
  stamps_ns.insert(stamps_ns.end(), rising.begin() + 100, rising.end());
  stamps_ns.insert(stamps_ns.end(), rising.begin() + 50, rising.begin() + 100);
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
              40 * kStep_ns + (later_ns == 0 ? 1'000'000'000 : 0));
  }
}

}  // namespace
}  // namespace slcmap
