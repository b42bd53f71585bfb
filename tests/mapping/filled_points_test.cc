// What is filled is a surface as what is measured.
#include <gtest/gtest.h>

#include "mapping/surfaces/bounded_plane.h"

namespace slcmap {
namespace {

DensePoint ComputePoint(const Eigen::Vector3d& p_world, DenseSource source) {
  DensePoint point;
  point.p_world = p_world;
  point.source = source;
  return point;
}

TEST(FilledPoints, AreOccupied) {
  MapResult map;
  const Eigen::Vector3d measured(1, 1, 1.02), filled(2, 1, 1.02);
  map.dense = {ComputePoint(measured, DenseSource::kStereo)};
  AddFilledPoints({ComputePoint(filled, DenseSource::kFilledPlane)}, 0.05, &map);
  EXPECT_EQ(map.dense.size(), 2u);
  EXPECT_TRUE(map.occupancy.IsOccupied(filled));
  EXPECT_FALSE(map.occupancy.IsOccupied(filled + Eigen::Vector3d(0, 0, 0.5)));
  RemoveFilledPoints(&map);
  ASSERT_EQ(map.dense.size(), 1u);
  EXPECT_EQ(map.dense[0].p_world, measured);
}

}  // namespace
}  // namespace slcmap
