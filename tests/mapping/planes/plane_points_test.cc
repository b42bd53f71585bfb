#include <gtest/gtest.h>

#include <cmath>

#include "mapping/surfaces/bounded_plane.h"
#include "tests/mapping/planes/wall_with_door.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kWallSigma_m = 0.005;

DensePoint PointAt(const Vector3d& p, double sigma_m) {
  return {p, -Vector3d::UnitY(), sigma_m, 100, DenseSource::kStereo};
}

// Where the point is then.
DensePoint Drawn(const DensePoint& point, const PlaneOptions& options = {},
                 const Building& building = testing::WallWithDoor(kWallSigma_m)) {
  std::vector<DensePoint> dense = {point};
  SnapToPlanes(building, options, &dense);
  EXPECT_EQ(dense.size(), 1u);
  return dense.front();
}

TEST(SnapToPlanes, PointsMoveAsFarAsTheyAreUncertain) {
  const double surface_m2 = 0.005 * 0.005 + 0.01 * 0.01, stereo_m2 = 0.04 * 0.04;
  const DensePoint uncertain = Drawn(PointAt({3, 2.94, 1}, 0.04));
  EXPECT_NEAR(3 - uncertain.p_world.y(), 0.06 * surface_m2 / (surface_m2 + stereo_m2), 1e-9);
  EXPECT_NEAR(uncertain.sigma_m, std::sqrt(surface_m2 * stereo_m2 / (surface_m2 + stereo_m2)),
              1e-9);
  EXPECT_EQ(uncertain.p_world.x(), 3);
  EXPECT_NEAR(Drawn(PointAt({3, 2.98, 1}, 0.001)).p_world.y(), 2.98, 2e-4);
}

TEST(SnapToPlanes, WhatIsNotOnThePlaneStays) {
  const auto stays = [](const DensePoint& point, const PlaneOptions& options = {},
                        const Building& building = testing::WallWithDoor(kWallSigma_m)) {
    return Drawn(point, options, building).p_world == point.p_world;
  };
  const DensePoint on_wall = PointAt({3, 2.94, 1}, 0.04);
  EXPECT_FALSE(stays(on_wall));
  EXPECT_TRUE(stays(PointAt({1.5, 2.94, 1}, 0.04))) << "in the door";
  EXPECT_TRUE(stays(PointAt({5, 2.94, 1}, 0.04))) << "beside the wall";
  EXPECT_TRUE(stays(PointAt({3, 2.8, 1}, 0.04))) << "before it";
  DensePoint turned = on_wall;
  turned.normal_world = Vector3d::UnitX();
  EXPECT_TRUE(stays(turned)) << "a cupboard's side";
  PlaneOptions none;
  none.draw_sigmas = 0;
  EXPECT_TRUE(stays(on_wall, none));
  Building unseen = testing::WallWithDoor(kWallSigma_m);
  unseen.planes[0].inferred = true;
  EXPECT_TRUE(stays(on_wall, {}, unseen));
}

TEST(SnapToPlanes, OfSeveralThatComeToOnePlaceTheBestStays) {
  std::vector<DensePoint> dense = {PointAt({3, 2.92, 1}, 0.05), PointAt({3, 3.001, 1}, 0.004),
                                   PointAt({3, 3.08, 1}, 0.05), PointAt({3.5, 2.92, 1}, 0.05)};
  SnapToPlanes(testing::WallWithDoor(kWallSigma_m), {}, &dense);
  ASSERT_EQ(dense.size(), 2u);
  EXPECT_NEAR(dense[0].p_world.y(), 3.001, 1e-3);
  EXPECT_EQ(dense[1].p_world.x(), 3.5);
}

}  // namespace
}  // namespace slcmap
