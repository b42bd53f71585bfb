#include "mapping/align/align_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/math.h"
#include "mapping/align/surface_union.h"
#include "tests/testing/scanned_map.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::ScannedAlong;
using testing::ScannedMap;
using testing::SceneFromText;

// A floor and a ceiling from x, y, of a size.
std::string Slabs(double x, double y, double width_m, double depth_m, double floor_m = 0) {
  const auto slab = [&](double z, const char* rest) {
    return "  - {kind: slab, at: [" + std::to_string(x) + ", " + std::to_string(y) + ", " +
           std::to_string(z) + "], size: [" + std::to_string(width_m) + ", " +
           std::to_string(depth_m) + "], " + rest + "}\n";
  };
  return slab(floor_m, "material: carpet") +
         slab(floor_m + 2.7, "material: ceiling, faces_down: true");
}

// Two rooms of different sizes with a door between them, and things in both.
Scene Flat() {
  return SceneFromText("objects:\n" + Slabs(0, 0, 9, 4) + R"(
  - {kind: wall, points: [[0, 0], [9, 0], [9, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, doors: [[0, 1.2, 1.0, 2.1, 90]]}
  - {kind: box, at: [0.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.2, 0.4, 0], size: [1.2, 0.6, 0.75]}
  - {kind: box, at: [8.2, 0.6, 0], size: [0.6, 1.0, 1.1]}
  - {kind: box, at: [6.4, 3.6, 0.9], size: [1.0, 0.3, 0.9]}
)");
}

const testing::Way kFlatWest = {{1.5, 2, 1.5}, {4, 2.4, 1.5}, {4.3, 1.7, 1.5}};
const testing::Way kFlatAll = {{7.5, 2.5, 1.5}, {6, 1.8, 1.5}, {4, 1.7, 1.5}, {2, 1.6, 1.5}};

RigidTransform Moved(double yaw_deg, const Vector3d& t = {3.2, -1.4, 0.7}) {
  return LevelTransform(yaw_deg * kDegree, t);
}

MapAlignment Align(const MapResult& first, const MapResult& second,
                   const std::optional<RoughStart>& start = std::nullopt) {
  AlignmentOptions options;
  options.start = start;
  return AlignMaps(first, second, options);
}

void ExpectAt(const MapAlignment& found, const RigidTransform& T_first_second, double within_m) {
  EXPECT_LT((found.T_first_second.translation - T_first_second.translation).norm(), within_m);
  EXPECT_LT(std::abs(ComputeYaw(found.T_first_second.Inverse() * T_first_second)), 0.1 * kDegree);
}

// The reason why maps are not aligned; a failure of the test where they are.
std::string WhyRefused(const MapResult& first, const MapResult& second) {
  try {
    const MapAlignment found = Align(first, second);
    ADD_FAILURE() << "aligned, with a rival of " << found.rival_share;
    return {};
  } catch (const AlignmentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("found"));
    EXPECT_THAT(error.what(), HasSubstr("expected"));
    return error.what();
  }
}

class AlignMapsTurned : public ::testing::TestWithParam<double> {};

TEST_P(AlignMapsTurned, TurnAndShiftAreFoundToMillimetres) {
  const Scene scene = Flat();
  const RigidTransform T = Moved(GetParam());
  const MapAlignment found =
      Align(ScannedMap(scene, kFlatAll), ScannedMap(scene, kFlatWest, T, "b"));
  ExpectAt(found, T.Inverse(), 0.005);
  EXPECT_LT(found.contradiction, 0.05);
  EXPECT_LT(found.rival_share, 0.4);
}

INSTANTIATE_TEST_SUITE_P(QuarterTurns, AlignMapsTurned, ::testing::Values(0, 90, 180, 270, 37));

TEST(AlignMaps, AWingThatIsTurnedIsNoObstacle) {
  const Scene scene = SceneFromText("objects:\n" + Slabs(-1, -5, 14, 14) + R"(
  - {kind: wall, points: [[0, 0], [6, 0], [11, 2.887], [9.5, 5.485], [5.5, 3], [0, 3]], closed: true}
  - {kind: box, at: [0.5, 2.4, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.2, 0.4, 0], size: [1.2, 0.6, 0.75]}
  - {kind: box, at: [8.6, 3.4, 0], size: [0.6, 0.8, 1.1], yaw_deg: 30}
)");
  const RigidTransform T = Moved(64);
  const MapAlignment found =
      Align(ScannedMap(scene, {{1.5, 1.5, 1.5}, {5.5, 1.5, 1.5}, {7, 2.3, 1.5}}),
            ScannedMap(scene, {{9.2, 3.6, 1.5}, {6.5, 2, 1.5}, {4.5, 1.5, 1.5}}, T, "b"));
  ExpectAt(found, T.Inverse(), 0.005);
}

TEST(AlignMaps, RoomsThatShareNothingAreRefused) {
  const Scene east = SceneFromText("objects:\n" + Slabs(0, 0, 3, 2.2) + R"(
  - {kind: wall, points: [[0, 0], [3, 0], [3, 2.2], [0, 2.2]], closed: true}
  - {kind: box, at: [2.3, 1.5, 0], size: [0.5, 0.5, 0.5]}
)");
  WhyRefused(ScannedMap(Flat(), kFlatWest),
             ScannedMap(east, {{1, 1, 1.5}, {1.5, 1, 1.5}}, {}, "b"));
}

TEST(AlignMaps, AMirroredBuildingIsRefused) {
  const Scene mirrored = SceneFromText("objects:\n" + Slabs(-9, 0, 9, 4) + R"(
  - {kind: wall, points: [[-9, 0], [0, 0], [0, 4], [-9, 4]], closed: true, skirting_height: 0.09}
  - {kind: wall, points: [[-5, 0], [-5, 4]], has_back: true, doors: [[0, 1.2, 1.0, 2.1, 90]]}
  - {kind: box, at: [-0.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [-3.2, 0.4, 0], size: [1.2, 0.6, 0.75]}
  - {kind: box, at: [-8.2, 0.6, 0], size: [0.6, 1.0, 1.1]}
  - {kind: box, at: [-6.4, 3.6, 0.9], size: [1.0, 0.3, 0.9]}
)");
  WhyRefused(
      ScannedMap(Flat(), kFlatAll),
      ScannedMap(mirrored, {{-7.5, 2.5, 1.5}, {-6, 1.8, 1.5}, {-4, 1.7, 1.5}, {-2, 1.6, 1.5}}, {},
                 "b"));
}

// A corridor without anything at its ends that is seen, with doors as far apart as given.
Scene CorridorWithDoors(const std::string& doors) {
  return SceneFromText("objects:\n" + Slabs(-30, -1, 60, 2) +
                       "  - {kind: wall, points: [[-30, -1], [30, -1], [30, 1], [-30, 1]], closed: "
                       "true, skirting_height: 0.09, doors: [" +
                       doors + "]}\n");
}

TEST(AlignMaps, AlongABlankCorridorNothingTells) {
  const Scene scene = CorridorWithDoors("");
  EXPECT_THAT(WhyRefused(ScannedMap(scene, {{-6, 0, 1.5}, {3, 0, 1.5}}),
                         ScannedMap(scene, {{-3, 0.2, 1.5}, {6, 0.2, 1.5}}, {}, "b")),
              HasSubstr("found two places"));
}

TEST(AlignMaps, DoorsAPeriodApartAreRefused) {
  std::string doors;
  for (int i = 0; i < 25; ++i) {
    doors += (i > 0 ? ", [0, " : "[0, ") + std::to_string(2 + 2.2 * i) + ", 0.95, 2.1, 0]";
  }
  const Scene scene = CorridorWithDoors(doors);
  EXPECT_THAT(WhyRefused(ScannedMap(scene, {{-6, 0, 1.5}, {3, 0, 1.5}}),
                         ScannedMap(scene, {{-3, 0.2, 1.5}, {6, 0.2, 1.5}}, {}, "b")),
              HasSubstr("found two places"));
}

// Two rooms that look alike, the one as the other, and between them one that does not.
Scene Twins() {
  return SceneFromText("objects:\n" + Slabs(0, 0, 12, 4) + R"(
  - {kind: wall, points: [[0, 0], [4, 0], [4, 4], [0, 4]], closed: true}
  - {kind: wall, points: [[4.2, 0], [7.8, 0], [7.8, 4], [4.2, 4]], closed: true}
  - {kind: wall, points: [[8, 0], [12, 0], [12, 4], [8, 4]], closed: true}
  - {kind: box, at: [1, 3.2, 0], size: [0.8, 0.6, 1.8], repeat: 2, step: [8, 0, 0]}
  - {kind: box, at: [3, 0.4, 0], size: [1.2, 0.6, 0.75], repeat: 2, step: [8, 0, 0]}
  - {kind: box, at: [6, 3.4, 0], size: [1.2, 0.6, 0.75]}
)");
}

TEST(AlignMaps, TwinRoomsAreRefusedAndARoughStartSaysWhich) {
  const Scene scene = Twins();
  const MapResult all = ScannedAlong(
      scene,
      {{{1.5, 2, 1.5}, {3, 2, 1.5}}, {{5, 2, 1.5}, {7, 2, 1.5}}, {{9.5, 2, 1.5}, {11, 2, 1.5}}});
  const RigidTransform T = Moved(20);
  const MapResult twin = ScannedMap(scene, {{10, 2.6, 1.5}, {10, 1.2, 1.5}}, T, "b");
  EXPECT_THAT(WhyRefused(all, twin), HasSubstr("found two places"));
  const RigidTransform truth = T.Inverse();
  const RoughStart start{truth.translation + Vector3d(0.8, -0.7, 0.2), ComputeYaw(truth) + 0.2};
  ExpectAt(Align(all, twin, start), truth, 0.01);
}

TEST(AlignMaps, IdenticalStoreysAreRefused) {
  const Scene scene = Flat();
  MapResult both = ScannedMap(scene, kFlatAll);
  const MapResult upper = ScannedMap(scene, kFlatAll, Moved(0, {0, 0, 3}));
  both.dense.insert(both.dense.end(), upper.dense.begin(), upper.dense.end());
  both.lines.insert(both.lines.end(), upper.lines.begin(), upper.lines.end());
  both.occupancy = UniteOccupancy(both.occupancy, upper.occupancy, {}, {}, 0.05);
  const MapResult other = ScannedMap(scene, kFlatWest, Moved(0, {0, 0, 3}), "b");
  EXPECT_THAT(WhyRefused(both, other), HasSubstr("found two places"));
  ExpectAt(Align(both, other, RoughStart{{0.5, 0, 0.3}, 0.1}), {}, 0.01);
}

TEST(AlignMaps, AMapWithoutHeadingsIsRefused) {
  MapResult plain = ScannedMap(Flat(), kFlatWest), bare = ScannedMap(Flat(), kFlatWest, {}, "b");
  bare.lines.clear();
  std::erase_if(bare.dense, [](const DensePoint& p) { return std::abs(p.normal_world.z()) < 0.9; });
  EXPECT_THAT(WhyRefused(plain, bare), HasSubstr("headings"));
}

}  // namespace
}  // namespace slcmap
