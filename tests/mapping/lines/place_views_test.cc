#include "mapping/lines/place_views.h"

#include <gtest/gtest.h>

#include <set>

namespace slcmap {
namespace {

// Every so manieth view shows two places, in each image one.
TrackedLine Shown(int views, int every, int max_views) {
  TrackedLine line;
  for (int view = 0; view < views; ++view) {
    const size_t before = line.places.size();
    if (view % every == every - 1) {
      line.places.push_back({view, 0});
      line.places.push_back({view, 1});
    }
    LimitViews(before, max_views, &line);
  }
  return line;
}

std::set<int> ViewsOf(const TrackedLine& line) {
  std::set<int> views;
  for (const EdgePlace& place : line.places) views.insert(place.view);
  return views;
}

TEST(PlaceViews, AreAllOfFew) { EXPECT_EQ(Shown(20, 1, 20).places.size(), 40u); }

TEST(PlaceViews, AreSpreadOverAllOfMany) {
  const std::set<int> views = ViewsOf(Shown(1000, 1, 20));
  EXPECT_LE(views.size(), 20u);
  EXPECT_GE(views.size(), 10u);
  EXPECT_EQ(*views.begin(), 0);
  EXPECT_GE(*views.rbegin(), 900);
}

TEST(PlaceViews, KeepBothImagesOfAView) {
  const TrackedLine line = Shown(1000, 1, 20);
  EXPECT_EQ(line.places.size(), 2 * ViewsOf(line).size());
}

TEST(PlaceViews, StayOfALineThatEveryEighthViewShows) {
  const std::set<int> views = ViewsOf(Shown(8000, 8, 20));
  EXPECT_LE(views.size(), 20u);
  EXPECT_GE(views.size(), 10u);
}

}  // namespace
}  // namespace slcmap
