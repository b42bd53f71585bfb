// Maps of runs whose images are opened again.
#include <gtest/gtest.h>

#include "mapping/mapping.h"
#include "odometry/run/run.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

MapResult MapOf(const Views& views, const MappingOptions& options = {}) {
  auto room = std::make_unique<RoomViews>(4, 0.25, 3);
  OdometryRun run;
  run.method = MethodName(Method::kSlc);
  run.complete = true;
  run.rectified_rig = room->rig();
  for (size_t i = 0; i < views.size(); ++i) {
    run.states.push_back({.stamp_ns = views[i].stamp_ns, .T_world_imu = views[i].T_world_imu});
    run.keyframes.push_back(
        {static_cast<int64_t>(i), 0, views[i].stamp_ns, views[i].T_world_imu, {}, {}});
  }
  RecordedViews recorded;
  recorded.views = views;
  recorded.images = std::move(room);
  return MapRun(run, &recorded, options);
}

TEST(MappedImages, OfTheRunAreTakenWithoutAWord) {
  EXPECT_FALSE(MapOf(RoomViews(4, 0.25, 3).views()).warnings.contains("poses_disagree"));
}

// As those of another recording, or of cameras that were exchanged, at the same stamps.
TEST(MappedImages, ThatAreNotThoseOfTheRunAreWarnedOf) {
  const Views as_taken = RoomViews(4, 0.25, 3).views();
  Views views = as_taken;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].T_world_imu = as_taken[(5 * i + 7) % views.size()].T_world_imu;
  }
  EXPECT_EQ(MapOf(views).warnings.at("poses_disagree"), 1);
}

// The run of these views has no lines of its own.
TEST(MappedImages, StagesCanBeSkipped) {
  const Views views = RoomViews(4, 0.25, 3).views();
  const MapResult whole = MapOf(views);
  EXPECT_FALSE(whole.lines.empty());
  EXPECT_FALSE(whole.building.planes.empty());
  EXPECT_FALSE(whole.warnings.contains("no_lines"));
  MappingOptions options;
  options.stages.lines = options.stages.building = false;
  const MapResult part = MapOf(views, options);
  EXPECT_FALSE(part.dense.empty());
  EXPECT_TRUE(part.lines.empty());
  EXPECT_TRUE(part.building.planes.empty());
  EXPECT_TRUE(part.complete);
  EXPECT_EQ(part.warnings.at("no_lines"), 1);
}

}  // namespace
}  // namespace slcmap
