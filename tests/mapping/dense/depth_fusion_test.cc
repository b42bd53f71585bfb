#include "mapping/dense/depth_fusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace slcmap {
namespace {

Camera FusionCamera() {
  Camera camera;
  camera.width_px = 400;
  camera.height_px = 300;
  camera.fx_px = camera.fy_px = 250;
  camera.cx_px = 199.5;
  camera.cy_px = 149.5;
  return camera;
}

// A wall across the optical axis, seen with noise.
DepthGrid NoisyWallAt(double depth_m, double sigma_m, int seed) {
  DepthGrid grid(FusionCamera(), 5);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  for (DepthNode& node : grid.nodes) {
    node.inverse_depth = static_cast<float>(1 / (depth_m + sigma_m * noise(random)));
    node.sigma = static_cast<float>(sigma_m / (depth_m * depth_m));
    node.grey = 90;
  }
  return grid;
}

RigidTransform LookingAlongX(double x_m) {
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {Eigen::Quaterniond(R), {x_m, 0, 0}};
}

RigidTransform LookingBackAlongX(double x_m) {
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, -1, 1, 0, 0, 0, -1, 0).finished();
  return {Eigen::Quaterniond(R), {x_m, 0, 0}};
}

TEST(DepthFusion, MakesOneFlatWallOfManyNoisyViews) {
  DenseOptions options;
  DepthFusion fusion(options);
  for (int i = 0; i < 12; ++i) {
    fusion.Add(LookingAlongX(0.02 * i), FusionCamera(), NoisyWallAt(2.0 - 0.02 * i, 0.03, i));
  }
  const std::vector<DensePoint> points = fusion.Points();
  // The views see some 3.2 x 2.4 m of it.
  const double voxels = 3.2 * 2.4 / (options.voxel_m * options.voxel_m);
  EXPECT_GT(points.size(), 0.7 * voxels);
  EXPECT_LT(points.size(), 1.3 * voxels);
  double squared = 0;
  for (const DensePoint& point : points) {
    squared += std::pow(point.p_world.x() - 2, 2);
    EXPECT_LT(point.normal_world.x(), -0.8);
    EXPECT_EQ(point.grey, 90);
    EXPECT_EQ(point.source, DenseSource::kStereo);
  }
  EXPECT_LT(std::sqrt(squared / points.size()), 0.01);
}

TEST(DepthFusion, KeepsTheSidesOfAThinWallApart) {
  DepthFusion fusion((DenseOptions()));
  for (int i = 0; i < 8; ++i) {
    fusion.Add(LookingAlongX(0), FusionCamera(), NoisyWallAt(2.0, 0.01, i));
    fusion.Add(LookingBackAlongX(4.03), FusionCamera(), NoisyWallAt(2.0, 0.01, 100 + i));
  }
  int64_t near = 0, far = 0;
  for (const DensePoint& point : fusion.Points()) {
    const bool is_near = point.normal_world.x() < 0;
    ++(is_near ? near : far);
    EXPECT_NEAR(point.p_world.x(), is_near ? 2.0 : 2.03, 0.015);
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 1000);
}

TEST(DepthFusion, ThinsOutWhereCoordinatesChangeTheirSignAsElsewhere) {
  DepthFusion fusion((DenseOptions()));
  for (int i = 0; i < 12; ++i) {
    fusion.Add(LookingAlongX(0.02 * i), FusionCamera(), NoisyWallAt(2.0 - 0.02 * i, 0.03, i));
  }
  const std::vector<DensePoint> points = fusion.Points();
  const auto count_at = [&](double z_m) {
    return static_cast<double>(std::count_if(
        points.begin(), points.end(),
        [&](const DensePoint& point) { return std::abs(point.p_world.z() - z_m) < 0.05; }));
  };
  const double elsewhere = 0.5 * (count_at(-0.4) + count_at(0.4));
  EXPECT_GT(elsewhere, 100);
  EXPECT_NEAR(count_at(0), elsewhere, 0.1 * elsewhere);
}

TEST(DepthFusion, LeavesOutWhatIsUncertain) {
  DenseOptions options;
  DepthFusion uncertain(options);
  DepthGrid wall = NoisyWallAt(2, 0.001, 1);
  for (DepthNode& node : wall.nodes) {
    node.sigma = static_cast<float>(1.1 * options.max_sigma_m / (2 * 2));
  }
  for (int i = 0; i < 20; ++i) uncertain.Add(LookingAlongX(0), FusionCamera(), wall);
  EXPECT_TRUE(uncertain.Points().empty());
}

TEST(DepthFusion, TakesAPlaceOnceItIsKnownToTheVoxelsSize) {
  DenseOptions options;
  options.max_sigma_m = 0.2;
  DepthGrid wall = NoisyWallAt(2, 0.0001, 1);
  const double sigma_m = 2.4 * options.voxel_m;
  for (DepthNode& node : wall.nodes) node.sigma = static_cast<float>(sigma_m / (2 * 2));
  DepthFusion fusion(options);
  fusion.Add(LookingAlongX(0), FusionCamera(), wall);
  const std::size_t once = fusion.Points().size();
  for (int i = 0; i < 4; ++i) fusion.Add(LookingAlongX(0), FusionCamera(), wall);
  EXPECT_GT(fusion.Points().size(), 2 * once);
}

}  // namespace
}  // namespace slcmap
