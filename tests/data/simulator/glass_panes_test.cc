#include <gtest/gtest.h>

#include <cmath>

#include "data/simulator/ray_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector3f;

TEST(GlassPanes, MirrorFourPerCentAFaceInFrontAndAllAtAGlance) {
  EXPECT_NEAR(MirroredShare(1), 2 * 0.04 / 1.04, 1e-5);
  EXPECT_NEAR(MirroredShare(0), 1, 1e-5);
  // At Brewster's angle a face mirrors of one polarisation ((1.5^2 - 1) / (1.5^2 + 1))^2.
  const float brewster = std::cos(std::atan(1.5f));
  const double face = 0.5 * std::pow(1.25 / 3.25, 2);
  EXPECT_NEAR(MirroredShare(brewster), 2 * face / (1 + face), 1e-5);
}

// Upright, across x.
ScenePane PaneAt(float x_m) { return {{x_m, -1, -1}, {0, 2, 0}, {0, 0, 2}}; }

TEST(GlassPanes, AreMetFromNearToFarAndNotBehindTheHit) {
  const GlassPanes panes({PaneAt(3), PaneAt(1), PaneAt(7)});
  RayScene::Packet packet;
  packet.Clear();
  packet.Set(0, Vector3f::Zero(), Vector3f(0.8f, 0, 0.6f).normalized(), 5);  // leaves above 1 m
  packet.Set(2, Vector3f::Zero(), Vector3f::UnitX(), 5);
  GlassPanes::Way way(panes, packet);
  GlassPanes::Mirrored mirrored;
  ASSERT_TRUE(way.Next(&mirrored));
  EXPECT_NEAR(mirrored.way_m[0], 1.25, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.dir_x[0], -0.8, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.dir_z[0], 0.6, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.org_z[0], 0.75, 1e-5);
  EXPECT_NEAR(mirrored.share[0], MirroredShare(0.8f), 1e-6);
  EXPECT_EQ(mirrored.share[1], 0);
  EXPECT_EQ(mirrored.rays.active[1], 0);
  EXPECT_NEAR(mirrored.way_m[2], 1, 1e-5);
  ASSERT_TRUE(way.Next(&mirrored));
  EXPECT_EQ(mirrored.share[0], 0);
  EXPECT_NEAR(mirrored.way_m[2], 3, 1e-4);
  EXPECT_FALSE(way.Next(&mirrored));
}

TEST(GlassPanes, StandBetweenPlaces) {
  const GlassPanes panes({PaneAt(3)});
  EXPECT_TRUE(panes.Between({2, 0, 0}, {4, 0, 0}));
  EXPECT_FALSE(panes.Between({2, 0, 0}, {2.9f, 0, 0}));
}

}  // namespace
}  // namespace slcmap
