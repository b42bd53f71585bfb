#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "data/core/parallel.h"

namespace slcmap {
namespace {

std::vector<int> All(ReadAhead<int>* row) {
  std::vector<int> items;
  while (!row->is_done()) items.push_back(row->Next());
  return items;
}

TEST(ReadAhead, GivesItemsInTheirOrder) {
  ReadAhead<int> row(
      20,
      [](size_t i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(i % 3));  // later ones may end sooner
        return static_cast<int>(i * i);
      },
      3);
  const std::vector<int> items = All(&row);
  ASSERT_EQ(items.size(), 20u);
  for (size_t i = 0; i < items.size(); ++i) EXPECT_EQ(items[i], static_cast<int>(i * i));
}

TEST(ReadAhead, ThrowsWhatMakingThrewWhereItsItemIsDue) {
  ReadAhead<int> row(3, [](size_t i) -> int {
    if (i == 1) throw std::runtime_error("lost");
    return static_cast<int>(i);
  });
  EXPECT_EQ(row.Next(), 0);
  EXPECT_THROW(row.Next(), std::runtime_error);
}

TEST(ReadAhead, LeavesRestUnmadeWhenItEnds) {
  std::atomic<int> made = 0;
  {
    ReadAhead<int> row(
        1000, [&](size_t) { return ++made; }, 3);
    row.Next();
  }
  EXPECT_EQ(made, 4);
}

TEST(ReadAhead, MakesItemsWhenAskedForWhereNoneIsToBeAhead) {
  const auto here = std::this_thread::get_id();
  int made = 0;
  ReadAhead<int> row(
      5,
      [&](size_t i) {
        EXPECT_EQ(std::this_thread::get_id(), here);
        ++made;
        return static_cast<int>(i);
      },
      0);
  row.Next();
  EXPECT_EQ(made, 1);
  EXPECT_EQ(All(&row), (std::vector{1, 2, 3, 4}));
}

}  // namespace
}  // namespace slcmap
