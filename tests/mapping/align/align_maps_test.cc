#include "mapping/align/align_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mapping/align/surface_union.h"
#include "tests/mapping/align/made_scenes.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::ScannedAlong;
using testing::ScannedMap;
using testing::SceneFromText;
using testing::Slabs;
using testing::TwoRoomFlat;

RigidTransform Moved(double yaw_deg, const Vector3d& t = {3.2, -1.4, 0.7}) {
  return testing::Turned(yaw_deg, t);
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

TEST(AlignMaps, TurnAndShiftAreFoundToMillimetres) {
  const MapResult all = ScannedMap(TwoRoomFlat(), testing::kWholeWay);
  for (const double turn_deg : {90, 180, 307}) {
    SCOPED_TRACE(turn_deg);
    const RigidTransform T = Moved(turn_deg);
    const MapAlignment found = Align(all, ScannedMap(TwoRoomFlat(), testing::kWestWay, T, "b"));
    ExpectAt(found, T.Inverse(), 0.005);
    EXPECT_LT(found.contradiction, 0.05);
    EXPECT_LT(found.rival_share, 0.4);
  }
}

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

TEST(AlignMaps, OtherRoomsAndAMirroredBuildingAreRefused) {
  const MapResult flat = ScannedMap(TwoRoomFlat(), testing::kWholeWay);
  const Scene other = SceneFromText("objects:\n" + Slabs(0, 0, 3, 2.2) + R"(
  - {kind: wall, points: [[0, 0], [3, 0], [3, 2.2], [0, 2.2]], closed: true}
  - {kind: box, at: [2.3, 1.5, 0], size: [0.5, 0.5, 0.5]}
)");
  WhyRefused(ScannedMap(TwoRoomFlat(), testing::kWestWay),
             ScannedMap(other, {{1, 1, 1.5}, {1.5, 1, 1.5}}, {}, "b"));
  testing::Way mirrored = testing::kWholeWay;
  for (Vector3d& p : mirrored) p.x() *= -1;
  WhyRefused(flat, ScannedMap(TwoRoomFlat(true), mirrored, {}, "b"));
}

// A corridor without anything at its ends that is seen, blank or with doors a period apart.
TEST(AlignMaps, AlongACorridorNothingTells) {
  std::string doors;
  for (int i = 0; i < 25; ++i) doors += fmt::format("[0, {}, 0.95, 2.1, 0], ", 2 + 2.2 * i);
  for (const std::string& in_wall : {std::string(), ", doors: [" + doors + "]"}) {
    const Scene scene = SceneFromText(
        "objects:\n" + Slabs(-30, -1, 60, 2) +
        "  - {kind: wall, points: [[-30, -1], [30, -1], [30, 1], [-30, 1]], closed: true, "
        "skirting_height: 0.09" +
        in_wall + "}\n");
    EXPECT_THAT(WhyRefused(ScannedMap(scene, {{-6, 0, 1.5}, {3, 0, 1.5}}),
                           ScannedMap(scene, {{-3, 0.2, 1.5}, {6, 0.2, 1.5}}, {}, "b")),
                HasSubstr("found two places"));
  }
}

TEST(AlignMaps, TwinRoomsAreRefusedAndARoughStartSaysWhich) {
  const MapResult all = ScannedAlong(testing::TwinRooms(), testing::kAllOfTwins);
  const RigidTransform T = Moved(20), truth = T.Inverse();
  const MapResult twin = ScannedMap(testing::TwinRooms(), testing::kSecondTwin, T, "b");
  EXPECT_THAT(WhyRefused(all, twin), HasSubstr("found two places"));
  const RoughStart start{truth.translation + Vector3d(0.8, -0.7, 0.2), ComputeYaw(truth) + 0.2};
  ExpectAt(Align(all, twin, start), truth, 0.01);
}

TEST(AlignMaps, IdenticalStoreysAreRefused) {
  const Scene scene = TwoRoomFlat();
  MapResult both = ScannedMap(scene, testing::kWholeWay);
  const MapResult upper = ScannedMap(scene, testing::kWholeWay, Moved(0, {0, 0, 3}));
  both.dense.insert(both.dense.end(), upper.dense.begin(), upper.dense.end());
  both.lines.insert(both.lines.end(), upper.lines.begin(), upper.lines.end());
  both.occupancy = UniteOccupancy(both.occupancy, upper.occupancy, {}, {}, 0.05);
  const MapResult other = ScannedMap(scene, testing::kWestWay, Moved(0, {0, 0, 3}), "b");
  EXPECT_THAT(WhyRefused(both, other), HasSubstr("found two places"));
  ExpectAt(Align(both, other, RoughStart{{0.5, 0, 0.3}, 0.1}), {}, 0.01);
}

TEST(AlignMaps, AMapWithoutHeadingsIsRefused) {
  MapResult bare = ScannedMap(TwoRoomFlat(), testing::kWestWay, {}, "b");
  bare.lines.clear();
  std::erase_if(bare.dense, [](const DensePoint& p) { return std::abs(p.normal_world.z()) < 0.9; });
  EXPECT_THAT(WhyRefused(ScannedMap(TwoRoomFlat(), testing::kWestWay), bare),
              HasSubstr("headings"));
}

}  // namespace
}  // namespace slcmap
