#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/evaluation/map_metrics.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<Vector3d> Upright(Vector3d from, Vector3d to, double low_m, double high_m) {
  from.z() = to.z() = low_m;
  const Vector3d up(0, 0, high_m - low_m);
  return {from, to, to + up, from + up};
}

// A true wall that looks along y, from x = 0 to 4 and of 2 m height, seen all over.
TrueWall WallAt(int64_t id, double y, double side) {
  TrueWall wall;
  wall.id = id;
  wall.normal = {0, side, 0};
  wall.offset_m = side * y;
  wall.seen_m2 = 8;
  wall.outline_world = Upright({0, y, 0}, {4, y, 0}, 0, 2);
  for (double x = 0.2; x < 4; x += 0.4) {
    for (double z = 0.2; z < 2; z += 0.4) wall.seen_world.push_back({x, y, z});
  }
  return wall;
}

BuildingPlane PlaneAt(double y, double side, double sigma_m) {
  BuildingPlane plane;
  plane.kind = PlaneKind::kWall;
  plane.normal = {0, side, 0};
  plane.offset_m = side * y;
  plane.sigma_m = sigma_m;
  plane.outline_world = Upright({0, y, 0}, {4, y, 0}, 0, 2);
  return plane;
}

// Two walls that face each other, 3 m apart.
TrueBuilding Truth() {
  TrueBuilding truth;
  truth.walls = {WallAt(0, 0, 1), WallAt(1, 3, -1)};
  TrueOpening door{7, true, true, false, 1, 0.9, Upright({1, 0, 0}, {1.9, 0, 0}, 0, 2)};
  truth.walls[0].openings = {door};
  door.id = 8;
  door.is_open = false;
  for (Vector3d& p : door.outline_world) p.y() = 3;
  truth.walls[1].openings = {door};
  TrueRoom room;
  room.polygon = {{{0, 0}, {4, 0}, {4, 3}, {0, 3}}, {}};
  room.area_m2 = 12;
  room.is_entered = true;
  truth.rooms = {room};
  return truth;
}

Building Mapped() {
  Building building;
  building.planes = {PlaneAt(0.01, 1, 0.006), PlaneAt(3.02, -1, 0.006)};
  PlaneOpening door{OpeningKind::kDoor, true, 0.92, 2, Upright({1, 0, 0}, {1.92, 0, 0}, 0, 2)};
  building.planes[0].openings = {door};
  Room room;
  room.polygon = {{{0, 0.01}, {4, 0.01}, {4, 3.02}, {0, 3.02}}, {}};
  room.area_m2 = 12.04;
  building.rooms = {room};
  return building;
}

TEST(BuildingMetrics, OffsetsDistancesAndIntervals) {
  const BuildingMetrics metrics = EvaluateBuilding(Truth(), Mapped());
  EXPECT_EQ(metrics.walls, 2);
  EXPECT_EQ(metrics.walls_found, 2);
  EXPECT_NEAR(metrics.offset_95_m, 0.02, 1e-9);
  EXPECT_EQ(metrics.distances, 1);
  EXPECT_NEAR(metrics.distance_error_95_m, 0.01, 1e-9);  // 3.01 m instead of 3
  EXPECT_EQ(metrics.intervals, 2);
  EXPECT_EQ(metrics.intervals_held, 1);
  Building others;  // of another side, or elsewhere
  others.planes = {PlaneAt(0, -1, 0.01), PlaneAt(3.3, -1, 0.01)};
  const BuildingMetrics missed = EvaluateBuilding(Truth(), others);
  EXPECT_EQ(missed.walls, 2);
  EXPECT_EQ(missed.walls_found, 0);
  EXPECT_EQ(missed.intervals, 0);
}

TEST(BuildingMetrics, PanesOfClearGlassAreOpeningsButThoseToTheOutsideMayBeMissed) {
  TrueBuilding truth = Truth();
  TrueOpening& pane = truth.walls[1].openings[0];
  pane.is_clear = true;
  Building building = Mapped();
  BuildingMetrics metrics = EvaluateBuilding(truth, building);
  EXPECT_EQ(metrics.openings, 1);
  EXPECT_DOUBLE_EQ(metrics.openings_f1, 1);
  PlaneOpening mapped = building.planes[0].openings[0];
  for (Vector3d& p : mapped.outline_world) p.y() = 3;
  building.planes[1].openings = {mapped};
  EXPECT_EQ(EvaluateBuilding(truth, building).openings_false, 0);
  truth.walls.push_back(WallAt(2, 3.1, 1));  // the other face of the same wall
  truth.walls[2].openings = {pane};
  metrics = EvaluateBuilding(truth, building);
  EXPECT_EQ(metrics.openings, 2);
  EXPECT_EQ(metrics.openings_found, 2);
  building.planes[1].openings.clear();
  EXPECT_EQ(EvaluateBuilding(truth, building).openings_found, 1);
}

TEST(BuildingMetrics, OpeningsOfClosedDoorsAreFalse) {
  Building building = Mapped();
  BuildingMetrics metrics = EvaluateBuilding(Truth(), building);
  EXPECT_EQ(metrics.openings, 1);
  EXPECT_EQ(metrics.openings_found, 1);
  EXPECT_DOUBLE_EQ(metrics.openings_f1, 1);
  EXPECT_NEAR(metrics.clear_width_median_m, 0.02, 1e-9);
  PlaneOpening closed = building.planes[0].openings[0];
  for (Vector3d& p : closed.outline_world) p.y() = 3;
  building.planes[1].openings = {closed};
  metrics = EvaluateBuilding(Truth(), building);
  EXPECT_EQ(metrics.openings_false, 1);
  EXPECT_NEAR(metrics.openings_f1, 2.0 / 3, 1e-9);
}

TEST(BuildingMetrics, RoomsAreRightWithinTwoPercent) {
  Building building = Mapped();
  EXPECT_EQ(EvaluateBuilding(Truth(), building).rooms_right, 1);
  building.rooms[0].polygon = {{{0, 0}, {4, 0}, {4, 3.2}, {0, 3.2}}, {}};
  building.rooms[0].area_m2 = 12.8;
  const BuildingMetrics metrics = EvaluateBuilding(Truth(), building);
  EXPECT_EQ(metrics.rooms_found, 1);
  EXPECT_EQ(metrics.rooms_right, 0);
  EXPECT_NEAR(metrics.area_error_median, 0.8 / 12, 1e-9);
}

TEST(BuildingMetrics, AlignmentMovesAllOfABuilding) {
  Alignment alignment;
  alignment.T_truth_estimate.rotation = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ());
  alignment.T_truth_estimate.translation = {10, 0, 0};
  const Building aligned = Aligned(alignment, Mapped());
  EXPECT_NEAR((aligned.planes[0].normal - Vector3d(-1, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(aligned.planes[0].offset_m, -9.99, 1e-9);
  EXPECT_NEAR((aligned.planes[0].outline_world[1] - Vector3d(9.99, 4, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((aligned.rooms[0].polygon.outline[1] - Eigen::Vector2d(9.99, 4)).norm(), 0, 1e-9);
}

TEST(BuildingMetrics, OfNothingAreNoFigures) {
  const BuildingMetrics metrics = EvaluateBuilding({}, {});
  const nlohmann::ordered_json json = BuildingJson({}, metrics);
  for (const char* key : {"offset_median_m", "offset_95_m", "distance_error_95_m", "openings_f1",
                          "clear_width_median_m", "area_error_median"}) {
    EXPECT_EQ(json.at(key).dump(), "null") << key;
  }
}

TruePipe TruePipeAt(int64_t id, double x_m, double radius_m, double seen_m) {
  return {id, {x_m, 0, 0}, {x_m, 0, 3}, radius_m, {{0.5, 0.5 + seen_m}}};
}

MapPipe PipeAt(double x_m, double radius_m) {
  MapPipe pipe;
  pipe.start_world = {x_m, 0, 2};
  pipe.end_world = {x_m, 0, 0.4};
  pipe.radius_m = radius_m;
  return pipe;
}

TEST(PipeMetrics, FoundAreThoseWithAxisAndRadius) {
  const std::vector<TruePipe> truth = {TruePipeAt(0, 0, 0.05, 2), TruePipeAt(1, 1, 0.1, 2),
                                       TruePipeAt(2, 2, 0.1, 1), TruePipeAt(3, 3, 0.1, 0.2)};
  // Found, with a wrong radius, too far off, one that was hardly seen, and one that is nowhere.
  const std::vector<MapPipe> pipes = {PipeAt(0.01, 0.052), PipeAt(1.02, 0.13), PipeAt(2.06, 0.1),
                                      PipeAt(3, 0.1), PipeAt(9, 0.1)};
  const PipeMetrics metrics = EvaluatePipes(truth, pipes);
  EXPECT_EQ(metrics.pipes, 3);
  EXPECT_EQ(metrics.found, 1);
  EXPECT_EQ(metrics.found_axes, 2);
  EXPECT_EQ(metrics.mapped, 5);
  EXPECT_EQ(metrics.false_pipes, 3);
  EXPECT_NEAR(metrics.radius_median_m, 0.002, 1e-9);
  EXPECT_NEAR(metrics.axis_median_m, 0.01, 1e-9);
  EXPECT_NEAR(metrics.found_m, 2, 1e-9);
  EXPECT_NEAR(metrics.seen_m, 5, 1e-9);
}

TEST(PipeMetrics, PipesThatAreTurnedOrElsewhereAlongTheAxisAreOthers) {
  MapPipe turned = PipeAt(0, 0.05), beyond = turned;
  turned.start_world.x() = 0.2;
  turned.end_world.x() = -0.2;
  beyond.start_world.z() = 4;
  beyond.end_world.z() = 5;
  const PipeMetrics metrics = EvaluatePipes({TruePipeAt(0, 0, 0.05, 2)}, {turned, beyond});
  EXPECT_EQ(metrics.found, 0);
  EXPECT_EQ(metrics.false_pipes, 2);
  const PipeMetrics nothing = EvaluatePipes({}, {});
  EXPECT_EQ(nothing.pipes, 0);
  EXPECT_TRUE(std::isnan(nothing.radius_95_m));
}

TEST(TruePipes, AreReadAsTheyWereWritten) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("pipes.csv");
  TruePipe pipe = TruePipeAt(0, 1, 0.05, 2), unseen = TruePipeAt(4, 2, 0.1, 0);
  pipe.seen.push_back({2.7, 3});
  unseen.seen.clear();
  WriteTruePipes(path, {pipe, unseen});
  const std::vector<TruePipe> read = ReadTruePipes(path);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].seen.size(), 2u);
  EXPECT_NEAR(read[0].SeenLength_m(), 2.3, 1e-9);
  EXPECT_EQ(read[1].id, 4);
  EXPECT_EQ(read[1].radius_m, 0.1);
  EXPECT_TRUE(read[1].seen.empty());
}

TEST(TruePipes, DamagedRowsAreNamed) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("pipes.csv");
  const std::string header = "pipe,ax_m,ay_m,az_m,bx_m,by_m,bz_m,radius_m,seen_from_m,seen_to_m\n";
  const auto refused = [&](const std::string& row, const std::string& message) {
    WriteFile(path, header + row + "\n");
    EXPECT_THAT([&] { ReadTruePipes(path); }, ThrowsMessage<DataError>(HasSubstr(message)));
  };
  refused("0,0,0,0,0,0,1,-0.1,0,1", "radius_m: found '-0.1', expected 0 to");
  refused("0,0,0,0,0,0,1,0.1,1,0.5", "seen_to_m: found '0.5', expected at least seen_from_m");
  refused("0,0,0,0,0,0,nan,0.1,0,1", "bz_m: found 'nan'");
  refused("0,0,0", "found 3 columns");
}

}  // namespace
}  // namespace slcmap
