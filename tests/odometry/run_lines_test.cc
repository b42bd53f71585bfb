#include <gtest/gtest.h>

#include <vector>

#include "odometry/run/run_queries.h"

namespace slcmap {
namespace {

LineObservation ObservationOf(int64_t id, double x_px) {
  return {id, {{x_px, 0}, {x_px, 100}}, std::nullopt};
}

std::vector<int64_t> IdsOf(const Keyframe& keyframe) {
  std::vector<int64_t> ids;
  for (const LineObservation& observation : keyframe.lines) ids.push_back(observation.id);
  return ids;
}

TEST(ResolveMergedLines, FollowsChainsToTheLineThatRemains) {
  OdometryRun run;
  run.line_merges = {{4, 2}, {7, 4}, {9, 7}, {8, 3}};
  ResolveMergedLines(&run);
  EXPECT_EQ(run.line_merges, (std::map<int64_t, int64_t>{{4, 2}, {7, 2}, {9, 2}, {8, 3}}));
}

TEST(ResolveMergedLines, KeyframesNameTheLineThatRemainsOnce) {
  OdometryRun run;
  run.line_merges = {{4, 2}, {7, 4}};
  run.keyframes.resize(2);
  run.keyframes[0].lines = {ObservationOf(1, 10), ObservationOf(4, 40), ObservationOf(7, 70)};
  run.keyframes[1].lines = {ObservationOf(2, 20), ObservationOf(3, 30), ObservationOf(7, 70)};
  ResolveMergedLines(&run);
  EXPECT_EQ(IdsOf(run.keyframes[0]), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(run.keyframes[0].lines[1].left_px.start.x(), 40);  // the oldest of those merged
  EXPECT_EQ(IdsOf(run.keyframes[1]), (std::vector<int64_t>{2, 3}));
  EXPECT_EQ(run.keyframes[1].lines[0].left_px.start.x(), 20);
}

TEST(ResolveMergedLines, ChangesNothingWhereNothingWasMerged) {
  OdometryRun run;
  run.keyframes.resize(1);
  run.keyframes[0].lines = {ObservationOf(1, 10), ObservationOf(5, 50)};
  ResolveMergedLines(&run);
  EXPECT_EQ(IdsOf(run.keyframes[0]), (std::vector<int64_t>{1, 5}));
  EXPECT_TRUE(run.line_merges.empty());
}

}  // namespace
}  // namespace slcmap
