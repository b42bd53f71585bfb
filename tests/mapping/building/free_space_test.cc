#include "mapping/building/free_space.h"

#include <gtest/gtest.h>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

FreeSpace Empty() { return {{Vector2d(0, 0), Vector2d(10, 10)}, 0.1}; }

// Of views with so many rays each; a ray ends at x = its number among all.
std::vector<ViewRays> RaysWith(const std::vector<int>& counts) {
  std::vector<ViewRays> seen;
  int number = 0;
  for (const int count : counts) {
    ViewRays view;
    for (int i = 0; i < count; ++i) {
      view.p_world.emplace_back(static_cast<float>(number++), 0.0F, 0.0F);
      view.sigma_m.push_back(0.01F);
    }
    seen.push_back(view);
  }
  return seen;
}

std::vector<int> CollectRays(const FreeSpaceRays& rays) {
  std::vector<int> numbers;
  for (size_t view = 0; view < rays.views(); ++view) {
    rays.ForEachIn(view, [&](const Vector3d&, const Vector3d& end, double) {
      numbers.push_back(static_cast<int>(end.x()));
    });
  }
  return numbers;
}

TEST(FreeSpace, AddsTheWaysOfAnother) {
  FreeSpace whole = Empty(), first = Empty(), second = Empty();
  for (FreeSpace* space : {&first, &second}) {
    for (int i = 0; i < 2; ++i) space->AddWay({1, 1}, {9, 1});  // three are needed
  }
  EXPECT_FALSE(first.IsFree({5, 1}));
  whole.AddWaysFrom(first);
  whole.AddWaysFrom(second);
  EXPECT_TRUE(whole.IsFree({5, 1}));
  EXPECT_FALSE(whole.IsFree({5, 3}));
}

TEST(FreeSpace, CountsNoMoreWaysThanFit) {
  FreeSpace whole = Empty(), many = Empty();
  for (int i = 0; i < 200; ++i) many.AddWay({1, 1}, {9, 1});
  whole.AddWaysFrom(many);
  whole.AddWaysFrom(many);  // 400 would be 144 in a byte, and 256 more none
  for (int i = 0; i < 56; ++i) whole.AddWay({1, 1}, {9, 1});
  EXPECT_TRUE(whole.IsFree({5, 1}));
}

TEST(FreeSpaceRays, AreAllOfFew) {
  const auto seen = RaysWith({2, 0, 3});
  EXPECT_EQ(CollectRays({seen, 100}), (std::vector{0, 1, 2, 3, 4}));
}

// Whichever views they are of, also those with fewer rays than one is taken of.
TEST(FreeSpaceRays, AreEverySoManiethOfMany) {
  const auto seen = RaysWith({4, 1, 1, 0, 5, 2});
  EXPECT_EQ(CollectRays({seen, 6}), (std::vector{0, 3, 6, 9, 12}));
}

TEST(FreeSpaceRays, AreGivenInRangesOfViewsUntilStopped) {
  const auto seen = RaysWith(std::vector<int>(100, 1));
  const FreeSpaceRays rays(seen, 1000);
  size_t next = 0;
  rays.ForSomeViews({}, [&](size_t begin, size_t end) {
    EXPECT_EQ(begin, next);
    next = end;
  });
  EXPECT_EQ(next, 100u);
  const Progress stops([](double share) { return share < 0.5; });
  EXPECT_THROW(rays.ForSomeViews(stops, [](size_t, size_t) {}), StoppedError);
}

}  // namespace
}  // namespace slcmap
