#include <gtest/gtest.h>

#include <numeric>

#include "apps/evaluation/truth.h"
#include "data/core/error.h"
#include "tests/testing/forward_rig.h"

namespace slcmap {
namespace {

using testing::ForwardRig;
using testing::Standing;
using testing::WallAtX;

double Length(const std::vector<PlySegment>& parts) {
  return std::accumulate(parts.begin(), parts.end(), 0.0, [](double sum, const PlySegment& part) {
    return sum + (part.end_world - part.start_world).norm();
  });
}

// Of edges that are seen from end to end; on a wall behind them all, with a pillar 1 m wide before.
std::vector<PlySegment> Clear(const std::vector<PlySegment>& edges, double seconds,
                              const ClearViewOptions& options = {}) {
  std::vector<Triangle> surfaces = WallAtX(20, 20);
  const std::vector<Triangle> pillar = WallAtX(2, 0.5);
  surfaces.insert(surfaces.end(), pillar.begin(), pillar.end());
  return ClearlySeen({edges, edges}, TriangleTree(surfaces), Standing(seconds), ForwardRig(),
                     options);
}

const std::vector<PlySegment> kBehindPillar = {{{4, -2, 0}, {4, 2, 0}}};

TEST(ClearEdges, WhatIsHiddenIsLeftOut) {
  const std::vector<PlySegment> parts = Clear(kBehindPillar, 2);
  ASSERT_EQ(parts.size(), 2u);
  // The pillar's half metre at 2 m hides one at 4 m.
  EXPECT_NEAR(parts[0].end_world.y(), -1, 0.041);
  EXPECT_NEAR(parts[1].start_world.y(), 1, 0.041);
  EXPECT_NEAR(Length(parts), 2, 0.081);
}

TEST(ClearEdges, ASurfaceThatTheEdgeIsOnDoesNotHideIt) {
  EXPECT_NEAR(Length(Clear({{{2, -0.4, 0.1}, {2, 0.4, 0.1}}}, 2)), 0.8, 1e-9);
}

TEST(ClearEdges, WhatIsBuriedInASurfaceIsHidden) {
  EXPECT_TRUE(Clear({{{2.01, -0.4, 0.1}, {2.01, 0.4, 0.1}}}, 2).empty());
}

TEST(ClearEdges, TwentyFramesAreNeeded) {
  EXPECT_TRUE(Clear(kBehindPillar, 0.9).empty());  // 19 of them
  EXPECT_FALSE(Clear(kBehindPillar, 0.95).empty());
  EXPECT_FALSE(Clear(kBehindPillar, 0.9, {.min_frames = 19}).empty());
}

TEST(ClearEdges, FarPlacesAndThoseOutsideTheImageAreLeftOut) {
  EXPECT_TRUE(Clear({{{9, 5, 0}, {9, 6, 0}}}, 2).empty());
  EXPECT_FALSE(Clear({{{9, 5, 0}, {9, 6, 0}}}, 2, {.max_range_m = 12}).empty());
  // At 4 m the image ends at 3.2 m from its middle.
  EXPECT_NEAR(Length(Clear({{{4, 2, 0}, {4, 6, 0}}}, 2)), 1.2, 0.05);
}

TEST(ClearEdges, ShortEdgesAreLeftOutButNotThePiecesOfABentOne) {
  const std::vector<PlySegment> pieces = {{{4, 1.5, 0}, {4, 1.7, 0}},
                                          {{4, 1.7, 0}, {4, 1.9, 0.01}}};
  EXPECT_TRUE(Clear(pieces, 2).empty());
  TrueEdges bent{pieces, pieces, {7, 7}};
  EXPECT_NEAR(
      Length(ClearlySeen(bent, TriangleTree(WallAtX(20, 20)), Standing(2), ForwardRig(), {})), 0.4,
      1e-3);
}

TEST(ClearEdges, AbsurdOptionsAreRefused) {
  EXPECT_THROW(Clear(kBehindPillar, 2, {.min_frames = 0}), ConfigError);
  EXPECT_THROW(Clear(kBehindPillar, 2, {.interval_s = 0}), ConfigError);
}

}  // namespace
}  // namespace slcmap
