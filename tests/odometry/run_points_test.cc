#include <gtest/gtest.h>

#include "odometry/run/run_queries.h"

namespace slcmap {
namespace {

Keyframe Seeing(const std::vector<int64_t>& ids) {
  Keyframe keyframe;
  for (const int64_t id : ids) keyframe.observations.emplace_back().landmark_id = id;
  return keyframe;
}

TEST(RunPoints, LivesAreCounted) {
  EXPECT_EQ(MeasurePointTracks({}).points, 0);
  EXPECT_EQ(MeasurePointTracks({Seeing({})}).points, 0);
  const PointTrackLengths lives =
      MeasurePointTracks({Seeing({1, 2, 3, 4}), Seeing({3, 5}), Seeing({4, 3, 6})});
  EXPECT_EQ(lives.points, 6);
  EXPECT_EQ(lives.seen_once, 4);
}

}  // namespace
}  // namespace slcmap
