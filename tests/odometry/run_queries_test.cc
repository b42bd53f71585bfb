#include "odometry/run/run_queries.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

constexpr double kNotFinite = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

KeyframeObservation& Seen(OdometryRun& run) { return run.keyframes[0].observations[0]; }
LineObservation& SeenLine(OdometryRun& run) { return run.keyframes[0].lines[0]; }

// One at a time, so that none hides behind another of its element.
TEST(FiniteRun, EveryValueIsLookedAtAndWhatHoldsItLeftOutAndCounted) {
  using Run = OdometryRun;
  const std::pair<const char*, double& (*)(Run&)> values[] = {
      {"states", [](Run& run) -> double& { return run.states[0].T_world_imu.translation.x(); }},
      {"states", [](Run& run) -> double& { return run.states[0].T_world_imu.rotation.z(); }},
      {"states", [](Run& run) -> double& { return run.states[0].velocity_world_m_s.y(); }},
      {"keyframes", [](Run& run) -> double& { return run.keyframes[0].T_world_imu.rotation.w(); }},
      {"observations", [](Run& run) -> double& { return Seen(run).left_px.x(); }},
      {"observations", [](Run& run) -> double& { return Seen(run).right_px->x(); }},
      {"line_observations", [](Run& run) -> double& { return SeenLine(run).left_px.end.y(); }},
      {"line_observations", [](Run& run) -> double& { return SeenLine(run).right_px->start.y(); }},
      {"landmarks", [](Run& run) -> double& { return run.landmarks[0].sigma_m; }},
      {"lines", [](Run& run) -> double& { return run.lines[0].end_world.z(); }},
      {"lines", [](Run& run) -> double& { return run.lines[0].covariance_m2(0, 1); }},
      {"manhattan_worlds", [](Run& run) -> double& { return run.manhattan_worlds[0].sigma_rad; }}};
  for (const auto& [kind, value] : values) {
    SCOPED_TRACE(kind);
    for (const double wrong : {kNotFinite, -kInfinity, 1e30}) {
      Run run = testing::MakeLineRun();
      value(run) = wrong;
      EXPECT_FALSE(IsFinite(run));
      const Run kept = WithoutNonFinite(run);
      EXPECT_TRUE(IsFinite(kept));
      const std::map<std::string, int64_t> counted{{std::string(kind) + "_not_finite", 1}};
      EXPECT_EQ(kept.warnings, counted);
    }
  }
}

LineObservation ObservationOf(int64_t id, double x_px) {
  return {id, {{x_px, 0}, {x_px, 100}}, std::nullopt};
}

std::vector<int64_t> IdsOf(const Keyframe& keyframe) {
  std::vector<int64_t> ids;
  for (const LineObservation& observation : keyframe.lines) ids.push_back(observation.id);
  return ids;
}

TEST(ResolveMergedLines, KeyframesNameTheLineThatRemainsOnce) {
  OdometryRun run;
  run.line_merges = {{4, 2}, {7, 4}, {9, 7}, {8, 3}};
  run.keyframes.resize(2);
  run.keyframes[0].lines = {ObservationOf(1, 10), ObservationOf(4, 40), ObservationOf(7, 70)};
  run.keyframes[1].lines = {ObservationOf(2, 20), ObservationOf(3, 30), ObservationOf(7, 70)};
  ResolveMergedLines(&run);
  EXPECT_EQ(run.line_merges, (std::map<int64_t, int64_t>{{4, 2}, {7, 2}, {9, 2}, {8, 3}}));
  EXPECT_EQ(IdsOf(run.keyframes[0]), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(run.keyframes[0].lines[1].left_px.start.x(), 40);  // the oldest of those merged
  EXPECT_EQ(IdsOf(run.keyframes[1]), (std::vector<int64_t>{2, 3}));
  EXPECT_EQ(run.keyframes[1].lines[0].left_px.start.x(), 20);
}

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

TEST(RunLines, LinesOfTheLastTenKeyframesAreRecent) {
  OdometryRun run;
  for (int i = 0; i < 30; ++i) run.keyframes.push_back({2 * i, 0, i, {}, {}, {}});
  run.lines.resize(3);
  run.lines[0].last_keyframe = 38;
  run.lines[1].last_keyframe = 40;
  run.lines[2].last_keyframe = 58;
  const std::vector<MapLine> lines = MapLines(run);
  EXPECT_FALSE(lines[0].recent);
  EXPECT_TRUE(lines[1].recent);
  EXPECT_TRUE(lines[2].recent);
  run.keyframes.resize(5);
  EXPECT_TRUE(MapLines(run)[0].recent);
}

TEST(RunLines, LivesAreCounted) {
  EXPECT_EQ(MeasureLineTracks({}).lines, 0);
  std::vector<Line> lines(4);
  const int seen[] = {3, 40, 10, 11};
  for (int i = 0; i < 4; ++i) lines[i].observations = seen[i];
  const LineTrackLengths lives = MeasureLineTracks(lines);
  EXPECT_EQ(lives.lines, 4);
  EXPECT_EQ(lives.median_keyframes, 10.5);
  EXPECT_EQ(lives.mean_keyframes, 16);
  EXPECT_EQ(lives.share_over_10, 0.5);
}

}  // namespace
}  // namespace slcmap
