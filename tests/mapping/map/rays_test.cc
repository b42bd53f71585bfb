#include "mapping/map/rays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "data/core/error.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int64_t kStamp_ns = 7;

// One keyframe at the origin that looks along z, and one line before it, in two pieces.
MapResult MapOfOneLine() {
  MapResult map;
  map.rectified_rig.cameras.assign(2, testing::PinholeCamera(640, 480, 400, 320, 240));
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
  LineSupport right = MeasureSupport(1, 400, 500), unknown = MeasureSupport(0, 120, 320),
              elsewhere = unknown;
  right.camera = 1;
  unknown.line_id = 99;
  elsewhere.stamp_ns = 8;  // no pose
  map.line_evidence.supports = {MeasureSupport(0, 120, 320), right, unknown, elsewhere};
  const std::vector<ViewRays> rays = CollectLineRays(map);
  ASSERT_THAT(rays, SizeIs(2));
  EXPECT_EQ(rays[0].p_world_camera, Vector3d::Zero());
  EXPECT_EQ(rays[1].p_world_camera, Vector3d(0.1, 0, 0));
  for (const auto& [of_image, count, from_x, to_x] :
       {std::tuple(rays[0], 4u, -1.0, 0.0), std::tuple(rays[1], 3u, 0.4, 1.0)}) {
    EXPECT_GE(of_image.p_world.size(), count);
    ASSERT_EQ(of_image.p_world.size(), of_image.sigma_m.size());
    for (size_t i = 0; i < of_image.p_world.size(); ++i) {
      const Eigen::Vector3f& p = of_image.p_world[i];
      EXPECT_NEAR(p.y(), 0.5, 1e-6);
      EXPECT_NEAR(p.z(), 2, 1e-6);
      EXPECT_GE(p.x(), from_x - 1e-6);
      EXPECT_LE(p.x(), to_x + 1e-6);
      EXPECT_GE(of_image.sigma_m[i], 0.01);
    }
  }
  std::swap(map.lines, map.marks);
  EXPECT_THAT(CollectLineRays(map), SizeIs(2)) << "marks are seen too";
  map.line_evidence.supports = {MeasureSupport(0, 520, 620)};
  EXPECT_THAT(CollectLineRays(map).at(0).p_world, IsEmpty()) << "beyond the piece";
}

// From a walk through the middle of a room of 10 x 10 x 3 m to points on its walls.
std::vector<RayBundle> MakeRays(int keyframes, int points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> along(-5, 5), up(0, 3);
  std::vector<RayBundle> rays;
  for (int i = 0; i < keyframes; ++i) {
    RayBundle bundle{{along(random) / 5, along(random) / 5, 1.5}, {}};
    for (int k = 0; k < points; ++k) {
      const double side = k % 4 < 2 ? -5 : 5;
      const Eigen::Vector3d x(side, along(random), up(random)), y(along(random), side, up(random));
      bundle.p_world.push_back(k % 2 == 0 ? x : y);
    }
    rays.push_back(bundle);
  }
  return rays;
}

TEST(Occupancy, AResolutionThatTakesTooMuchMemoryIsRefusedWithOneThatDoes) {
  const std::vector<RayBundle> rays = MakeRays(200, 20);
  OccupancyOptions options;
  options.resolution_m = 0.02;
  options.max_voxels = 100000;
  std::map<std::string, int64_t> warnings;
  const std::string message =
      testing::MessageOf<ConfigError>([&] { MapOccupancy(rays, options, &warnings); });
  EXPECT_THAT(message,
              AllOf(HasSubstr("mapping.occupancy.resolution_m: found 0.02, which takes more than "),
                    HasSubstr("100000 voxels (mapping.occupancy.max_voxels)")));
  const std::string before = "expected at least ";
  options.resolution_m = std::stod(message.substr(message.find(before) + before.size()));
  EXPECT_GT(options.resolution_m, 0.02);
  EXPECT_NO_THROW(MapOccupancy(rays, options, &warnings));
}

TEST(Occupancy, RaysOutOfTheOctreeAreAWarningOfTheMap) {
  OccupancyOptions options;
  options.max_range_m = 10;
  std::map<std::string, int64_t> warnings;
  MapOccupancy({{{4000, 0, 0}, {{4001, 0, 0}, {4002, 0, 0}}}}, options, &warnings);
  EXPECT_EQ(warnings[kRayOutOfOctree], 2);
}

}  // namespace
}  // namespace slcmap
