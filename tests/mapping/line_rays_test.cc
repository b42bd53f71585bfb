#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mapping/map/rays.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int64_t kStamp_ns = 7;

// One keyframe at the origin that looks along z, and one line before it, in two pieces.
MapResult MapOfOneLine() {
  MapResult map;
  map.rectified_rig.cameras.fill(testing::PinholeCamera(640, 480, 400, 320, 240));
  map.rectified_rig.T_imu_camera[1].translation = {0.1, 0, 0};
  map.keyframes.push_back({kStamp_ns, {}});
  MapLine line;
  line.id = 3;
  line.sigma_m = 0.001;
  line.start_world = {-1, 0.5, 2};
  line.end_world = {0, 0.5, 2};
  map.lines.push_back(line);
  line.start_world = {0.4, 0.5, 2};
  line.end_world = {1, 0.5, 2};
  map.lines.push_back(line);
  return map;
}

LineSupport MeasureSupport(int piece, double from_x_px, double to_x_px) {
  return {3, piece, kStamp_ns, 0, {Vector2d(from_x_px, 340), Vector2d(to_x_px, 340)}};
}

TEST(LineRays, EndOnTheLineThatIsSeen) {
  MapResult map = MapOfOneLine();
  map.line_evidence.supports = {MeasureSupport(0, 120, 320)};
  const std::vector<ViewRays> rays = CollectLineRays(map);
  ASSERT_THAT(rays, SizeIs(1));
  EXPECT_EQ(rays[0].p_world_camera, Vector3d::Zero());
  EXPECT_GE(rays[0].p_world.size(), 4u);
  ASSERT_EQ(rays[0].p_world.size(), rays[0].sigma_m.size());
  for (size_t i = 0; i < rays[0].p_world.size(); ++i) {
    const Eigen::Vector3f& p = rays[0].p_world[i];
    EXPECT_NEAR(p.y(), 0.5, 1e-6);
    EXPECT_NEAR(p.z(), 2, 1e-6);
    EXPECT_GE(p.x(), -1);
    EXPECT_LE(p.x(), 0);
    EXPECT_GE(rays[0].sigma_m[i], 0.01);
  }
}

TEST(LineRays, PixelsBeyondThePieceTellNothing) {
  MapResult map = MapOfOneLine();
  map.line_evidence.supports = {MeasureSupport(0, 520, 620)};
  const std::vector<ViewRays> rays = CollectLineRays(map);
  ASSERT_THAT(rays, SizeIs(1));
  EXPECT_TRUE(rays[0].p_world.empty());
}

TEST(LineRays, AreOfEachImageAndOfThePieceThatItShows) {
  MapResult map = MapOfOneLine();
  LineSupport right = MeasureSupport(1, 400, 500);
  right.camera = 1;
  map.line_evidence.supports = {MeasureSupport(0, 120, 320), right};
  const std::vector<ViewRays> rays = CollectLineRays(map);
  ASSERT_THAT(rays, SizeIs(2));
  EXPECT_EQ(rays[1].p_world_camera, Vector3d(0.1, 0, 0));
  for (const Eigen::Vector3f& p : rays[1].p_world) EXPECT_GE(p.x(), 0.4f);
}

TEST(LineRays, MarksAreSeenToo) {
  MapResult map = MapOfOneLine();
  std::swap(map.lines, map.marks);
  map.line_evidence.supports = {MeasureSupport(0, 120, 320)};
  EXPECT_THAT(CollectLineRays(map), SizeIs(1));
}

TEST(LineRays, WhatHasNoPoseOrNoLineTellsNothing) {
  MapResult map = MapOfOneLine();
  LineSupport unknown = MeasureSupport(0, 120, 320);
  unknown.line_id = 99;
  LineSupport elsewhere = MeasureSupport(0, 120, 320);
  elsewhere.stamp_ns = 8;
  map.line_evidence.supports = {unknown, elsewhere};
  EXPECT_THAT(CollectLineRays(map), IsEmpty());
}

}  // namespace
}  // namespace slcmap
