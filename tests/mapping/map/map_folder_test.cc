// Maps in their folders: what was written comes back, and what is damaged is named.
#include "mapping/map/map_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/ply.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/part_files.h"
#include "mapping/mapping.h"
#include "tests/testing/made_building.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::ThrowsMessage;

// With something of each kind.
MapResult MakeFullMap() {
  OdometryRun run = testing::MakeLineRun();
  run.id = "0123456789abcdef";
  run.source = testing::MakeSource(run);
  run.verdict.emplace().Add({VerdictLevel::kDoubtful, "speed", "a", "b", "c"});
  MappingOptions options;
  options.cloud.voxel_m = 0.25;
  MapResult map = MapRun(run, nullptr, options);
  map.dense = {{{1, 2, 3}, Eigen::Vector3d::UnitZ(), 0.015625, 77}};
  map.filled = {{{2, 2, 3}, Eigen::Vector3d::UnitX(), 0.0078125, 200}};
  map.marks = {map.lines.back()};
  map.marks[0].id = 500;
  map.patterns.emplace_back().spacing_m = 0.25;
  map.patterns[0].line_ids = {500};
  map.patterns[0].across_m = {-1, 2};
  map.pipes = {{0, 0, LineAxis::kVertical, -1, {1, 2, 0}, {1, 2, 2.5}, 0.0612, 0.0021, 0.00047, 40},
               {1, 0, LineAxis::kX, 2, {-1, 2, 2}, {4, 2, 2}, 0.1, 0.003, 0.001, 7}};
  map.source.georeference = Georeference{"EPSG:25832", {691607.25, 5334760.5, 515}, 0.75, 1};
  map.control.emplace().points = {{"P1", ControlStatus::kOutlier, {1, 2, 3}, {0.01, 0.01, 0.01}}};
  map.plan.emplace().walls = {
      {PlanStatus::kDeviates, 3, 4, {1, 2}, {3, 2}, 0.012, 0.004, 0.001, 0.002},
      {PlanStatus::kMissing, 5, -1, {0, 0}, {2, 0}}};
  map.plan->openings = {{PlanStatus::kAsPlanned, 0, 2, {1, 0}, {2, 0}, 0.003, 0.01, -0.004, 0.02}};

  Building& building = map.building;
  building = testing::MakeBuilding();
  building.name = "House";
  building.storeys[0].ceiling_m.reset();
  building.storeys[0].name = "Ground";
  building.rooms[0].polygon.holes = {{{1, 1}, {1, 2}, {2, 2}}};
  building.rooms[0].bounded = 0.75;
  building.rooms[0].seen_share = 0.5;
  building.rooms[0].name = "Lab";
  BuildingPlane wall, floor;
  wall.kind = PlaneKind::kWall;
  wall.normal = {0.6, 0.8, 0};
  wall.sigma_m = 0.004;
  wall.outline_world = floor.outline_world = {{0, 0, 0}, {1, 0, 0}, {1, 0, 2}, {0, 0, 2}};
  wall.openings = {{OpeningKind::kDoor, true, 0.9, 2.05, wall.outline_world}};
  wall.room_ids = {0};
  wall.inferred = true;
  floor.id = 1;
  floor.kind = PlaneKind::kFloor;
  floor.normal = Eigen::Vector3d::UnitZ();
  building.planes = {wall, floor};
  building.walls[0].plane_ids = {0};
  building.walls[0].openings[0].name = "D-01";
  building.walls[2].seen_share = 0.25;
  building.T_map_world.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
  map.seen_share = 0.75;
  return map;
}

const MapResult& FullMap() {
  static const MapResult map = MakeFullMap();
  return map;
}

class MapFolderTest : public ::testing::Test {
 protected:
  MapFolderTest() { WriteMapFolder(folder_, map_); }

  // Reading must fail with a message that holds this.
  void ExpectReadError(const std::string& what, bool accept_changed = false) const {
    EXPECT_THAT(
        MessageOf<DataError>([&] { ReadMapFolder(folder_, {.accept_changed = accept_changed}); }),
        HasSubstr(what));
  }

  // What is said where a file is another, whether or not changes are accepted.
  void ExpectRefused(const std::string& name, const std::string& text, const std::string& message,
                     bool also_unaccepted = true) const {
    const std::string path = folder_ + "/" + name, good = ReadFile(path);
    WriteFile(path, text);
    ExpectReadError(message, true);
    if (also_unaccepted) ExpectReadError(message);
    WriteFile(path, good);
  }

  // The same where a text in it is another.
  void ExpectRefusedEdit(const std::string& name, const std::string& from, const std::string& to,
                         const std::string& message) const {
    std::string text = ReadFile(folder_ + "/" + name);
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    ExpectRefused(name, text.replace(at, from.size(), to), message, false);
  }

  // The same where other rows are in the place of the first ones behind the header.
  void ExpectRefusedRows(const std::string& name, const std::vector<std::string>& rows,
                         const std::string& message) const {
    std::istringstream text(ReadFile(folder_ + "/" + name));
    std::string damaged, row;
    for (std::size_t i = 0; std::getline(text, row); ++i) {
      damaged += (i > 0 && i <= rows.size() ? rows[i - 1] : row) + "\n";
    }
    ExpectRefused(name, damaged, name + ": row " + message);
  }

  const MapResult& map_ = FullMap();
  const testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/map");
  const std::string stamp_ = std::to_string(map_.keyframes[0].stamp_ns);
};

// Reading takes in all that was written, but for what says how the map was made.
TEST_F(MapFolderTest, AMapComesBack) {
  const MapResult read = ReadMapFolder(folder_);
  const std::string again = temp_.Path("again");
  WriteMapFolder(again, read);
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::string name = entry.path().filename();
    if (name == "map.json" || name == "occupancy.ot" || name == "calibration.yaml") continue;
    EXPECT_EQ(ReadFile(folder_ + "/" + name), ReadFile(again + "/" + name)) << name;
  }
  Json summaries[] = {Json::parse(ReadFile(folder_ + "/map.json")),
                      Json::parse(ReadFile(again + "/map.json"))};
  for (Json& summary : summaries) {
    for (const char* key : {"id", "checksum", "files"}) summary.erase(key);
  }
  EXPECT_EQ(summaries[0], summaries[1]);

  EXPECT_EQ(read.method, "points");
  EXPECT_EQ(read.source.run_id, "0123456789abcdef");
  EXPECT_EQ(read.source.sequence, "/recordings/hall");
  EXPECT_THAT(read.source.options, HasSubstr("\n  cloud:\n"));
  EXPECT_THAT(read.source.options, HasSubstr("    voxel_m: 0.25\n"));
  EXPECT_EQ(read.rectified_rig.cameras[0].fx_px, 320);
  ASSERT_TRUE(read.verdict.has_value());
  EXPECT_EQ(read.verdict->level, VerdictLevel::kDoubtful);
  EXPECT_EQ(read.verdict->reasons.at(0).what, "speed");
  EXPECT_EQ(read.keyframes.back().stamp_ns, map_.keyframes.back().stamp_ns);
  EXPECT_EQ(read.occupancy.OccupiedVoxels().size(), map_.occupancy.OccupiedVoxels().size());
  EXPECT_EQ(read.source.georeference->origin_m.x(), 691607.25);
  EXPECT_THAT(ReadFile(folder_ + "/georeference.json"),
              AllOf(HasSubstr("\"crs_name\": \"ETRS89 / UTM zone 32N\""),
                    HasSubstr("\"latitude_deg\": 48.13")));
  EXPECT_EQ(read.control->points.at(0).status, ControlStatus::kOutlier);
  EXPECT_THAT(ReadFile(folder_ + "/control_points.csv"), HasSubstr("\nP1,outlier,"));
  EXPECT_EQ(read.plan->walls.at(1).status, PlanStatus::kMissing);
  EXPECT_NEAR(read.plan->openings.at(0).wider_m, -0.004, 1e-9);
  EXPECT_THAT(ReadFile(folder_ + "/plan_deviations.csv"),
              AllOf(HasSubstr("wall,deviates,3,4,1.0000,2.0000,3.0000,2.0000,12.0,4.0"),
                    HasSubstr("wall,missing,5,-1")));
}

TEST_F(MapFolderTest, PointsLinesAndTheirEvidenceComeBack) {
  const MapResult read = ReadMapFolder(folder_);
  ASSERT_EQ(read.points.size(), map_.points.size());
  EXPECT_LT((read.points[9].p_world - map_.points[9].p_world).norm(), 1e-5);
  EXPECT_EQ(read.points[9].observations, map_.points[9].observations);
  EXPECT_NEAR(read.points[9].sigma_m, map_.points[9].sigma_m, 1e-6);
  EXPECT_EQ(read.points[9].line_id, map_.points[9].line_id);
  const MapPointObservation &seen = read.point_observations.at(9),
                            &saw = map_.point_observations[9];
  EXPECT_EQ(MakeKey(seen), MakeKey(saw));
  EXPECT_LT((seen.px - saw.px).norm(), 0.001);
  EXPECT_EQ(read.dense.at(0).grey, 77);
  EXPECT_EQ(read.filled.at(0).p_world, map_.filled[0].p_world);
  // Viewers show a cloud in colour by these names alone.
  const std::string path = folder_ + "/dense.ply";
  const PlyElement vertices = ReadPly(path).Get("vertex", path);
  for (const char* name : {"red", "green", "blue", "grey"}) {
    EXPECT_EQ(vertices.Get(name, path).values.at(0), 77) << name;
  }
  ASSERT_EQ(read.lines.size(), 24u);
  EXPECT_EQ(read.lines[23].id, 123);
  EXPECT_EQ(read.lines[23].axis, LineAxis::kY);
  EXPECT_LT((read.lines[23].end_world - map_.lines[23].end_world).norm(), 1e-6);
  // Both images of the first four keyframes, and the vertical ones in that at 5 s.
  ASSERT_EQ(read.line_evidence.supports.size(), 2 * (4 * 24 + 20u));
  const LineSupport &support = read.line_evidence.supports[1],
                    &supported = map_.line_evidence.supports[1];
  EXPECT_EQ(support.line_id, 100);
  EXPECT_EQ(support.stamp_ns, map_.keyframes[0].stamp_ns);
  EXPECT_EQ(support.camera, 1);
  EXPECT_LT((support.px.end - supported.px.end).norm(), 0.01);
  const LineCovariance &covariance = read.line_evidence.covariances.at(23),
                       &was = map_.line_evidence.covariances[23];
  EXPECT_EQ(covariance.line_id, 123);
  EXPECT_LT((covariance.start_end_m2 - was.start_end_m2).norm(), 1e-5 * was.start_m2.norm());
  EXPECT_EQ(read.marks.at(0).id, 500);
  EXPECT_EQ(read.patterns.at(0).line_ids, std::vector<int64_t>{500});
  EXPECT_EQ(read.pipes.at(0).end_world, Eigen::Vector3d(1, 2, 2.5));
  EXPECT_EQ(read.pipes[0].radius_m, 0.0612);
}

TEST_F(MapFolderTest, TheBuildingComesBack) {
  const MapResult read = ReadMapFolder(folder_);
  const Building& building = read.building;
  EXPECT_EQ(building.name, "House");
  EXPECT_EQ(building.storeys.at(0).name, "Ground");
  EXPECT_FALSE(building.storeys[0].ceiling_m);
  EXPECT_EQ(building.rooms.at(0).name, "Lab");
  EXPECT_EQ(building.rooms[0].polygon.holes.size(), 1u);
  EXPECT_LT((building.planes.at(0).normal - Eigen::Vector3d(0.6, 0.8, 0)).norm(), 1e-12);
  EXPECT_TRUE(building.planes[0].inferred && !building.planes.at(1).inferred);
  EXPECT_TRUE(building.planes[0].openings.at(0).walked);
  EXPECT_EQ(building.walls.at(0).openings.at(0).name, "D-01");
  EXPECT_TRUE(building.walls.at(3).thickness_assumed);
  EXPECT_NEAR(Eigen::AngleAxisd(building.T_map_world.rotation).angle(), 0.3, 1e-9);
  EXPECT_EQ(read.seen_share, 0.75);
  EXPECT_EQ(building.rooms[0].seen_share, 0.5);
  EXPECT_FALSE(building.walls[1].seen_share);
  EXPECT_EQ(building.walls[2].seen_share, 0.25);
}

TEST_F(MapFolderTest, WhatAMapHasNotIsNotThereAnyMore) {
  WriteMapFolder(folder_, MapRun(testing::MakeLineRun(), nullptr, {}));
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_FALSE(read.control || read.plan || read.seen_share);
  EXPECT_TRUE(read.pipes.empty() && read.patterns.empty() && read.building.planes.empty());
}

TEST_F(MapFolderTest, MissingAndDamagedFilesAreNamed) {
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::string name = entry.path().filename(), good = ReadFile(entry.path());
    std::filesystem::remove(entry.path());
    ExpectReadError(name);
    WriteFile(entry.path(), "damaged");
    ExpectReadError(name);
    WriteFile(entry.path(), good);
  }
}

TEST_F(MapFolderTest, WhatCannotBeIsNamedWithItsFileAndKey) {
  const char *const pipes = "pipes.json", *const planes = "planes.json";
  ExpectRefusedEdit(pipes, "\"segment\": 0", "\"segment\": 4294967296",
                    "segment: found 4294967296, expected 0 to");
  ExpectRefusedEdit(pipes, "\"segment\": 0", "\"segment\": 0.7",
                    "segment: found 0.7, expected 0 to");
  ExpectRefusedEdit(pipes, "0.0612", "-0.0612",
                    "pipe 0: radius_m: found -0.0612, expected 0.0001 to");
  ExpectRefusedEdit(pipes, "0.0612", "1e999", "pipes.json: ");
  ExpectRefusedEdit(pipes, "0.0612", "null", "radius_m: found null, expected 0.0001 to");
  ExpectRefusedEdit(pipes, "\"vertical\"", "\"up\"",
                    "pipe 0: axis: found 'up', expected one of: x, y");
  ExpectRefusedEdit(pipes, "\"id\": 1", "\"id\": 0", "pipe 0: found it at place 1, expected ids");
  ExpectRefusedEdit(pipes, "\"images\": 40", "\"images\": -1", "images: found -1, expected 0 to");
  ExpectRefusedEdit(pipes, "\"radius_sigma_m\": 0.00047,", "", "radius_sigma_m: missing");
  ExpectRefusedEdit(pipes, "2.5", "0", "pipe 0: found an end that is its start");
  ExpectRefusedEdit(pipes, "2.5", "2e6", "pipe 0: found the point");
  ExpectRefused(pipes, "{}", "found no list", false);
  ExpectRefusedEdit(planes, "\"wall\"", "\"roof\"",
                    "planes.json: plane 0: kind: found 'roof', expected one of: wall, floor");
  ExpectRefusedEdit(planes, "\"sigma_m\": 0.004", "\"sigma_m\": -1", "sigma_m: found -1");
  ExpectRefusedEdit(planes, "0.8", "0.9", "expected 1");
  ExpectRefusedEdit(planes, "\"offset_m\"", "\"offset\"", "offset_m: missing");
  ExpectRefusedEdit(planes, "\"storey\": 0", "\"storey\": 4", "reference to storey 4");
  ExpectRefusedEdit("rooms.json", "\"bounded\": 0.75", "\"bounded\": 1.5",
                    "rooms.json: room 0: bounded: found 1.5");
  ExpectRefusedEdit("rooms.json", "\"id\": 0", "\"id\": 3", "expected ids to count from 0");
  ExpectRefusedEdit("plan.json", "\"version\": 1", "\"version\": 9", "version 9");
  PlyFile dense = ReadPly(folder_ + "/dense.ply");
  for (PlyProperty& property : dense.elements[0].properties) {
    if (property.name == "source") property.values[0] = 5;
  }
  WritePly(folder_ + "/dense.ply", dense);
  ExpectReadError("dense.ply", true);
  MapResult map = MakeFullMap();
  map.points[1].line_id = 1000;
  WriteMapFolder(folder_, map);
  ExpectReadError("points.ply: vertex row 2: found line_id 1000");
  map.points[1].line_id = -1;
  map.seen_share = 1.5;
  WriteMapFolder(folder_, map);
  ExpectReadError("seen_share: found 1.5, expected 0 to 1");
  map.seen_share = 1;
  map.patterns[0].across_m = {1, -1};
  WriteMapFolder(folder_, map);
  ExpectReadError("expected the lesser first");
  map.patterns[0].direction_world = {0.5, 0, 0};
  WriteMapFolder(folder_, map);
  ExpectReadError("pattern 0: direction");
}

TEST_F(MapFolderTest, ChangedFilesAreRefusedUnlessAccepted) {
  const std::string path = folder_ + "/points.ply", bytes = ReadFile(path);
  std::string moved = bytes;
  moved[bytes.size() - 13] ^= 1;  // of a coordinate's bits
  WriteFile(path, moved);
  EXPECT_THAT(MessageOf<DataError>([&] { ReadMapFolder(folder_); }),
              AllOf(HasSubstr("points.ply: found "), HasSubstr("--accept-changed")));
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).points.size(), map_.points.size());
  PlyFile far = ReadPly(path);
  far.elements[0].properties[0].values[2] = 1e30;
  WritePly(path, far);
  ExpectReadError("points.ply: vertex row 3: x: found 1", true);
  WriteFile(path, bytes);
  const std::string poses = folder_ + "/trajectory.tum", rows = ReadFile(poses);
  WriteFile(poses, rows.substr(0, rows.rfind('\n', rows.size() - 2) + 1));
  ExpectReadError("found 50 poses, expected 51 as in map.json");
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).trajectory.size(), 50u);
}

TEST_F(MapFolderTest, DamagedCovariancesAreNamed) {
  const std::string name = "line_covariances.csv",
                    zeros = ",0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0";
  ExpectRefusedRows(name, {"100,0,1e-6,0"}, "2: found 4 columns, expected 23");
  ExpectRefusedRows(name, {"100,0" + zeros, "99,0" + zeros},
                    "3: line_id: found '99', expected the id of a line in lines.ply or marks.ply");
  ExpectRefusedRows(name, {"100,0" + zeros, "100,0" + zeros},
                    "3: line_id: found '100', expected rows");
  ExpectRefusedRows(name, {"100,1" + zeros},
                    "2: piece: found '1', expected less than the 1 pieces");
  ExpectRefusedRows(name, {"100,0,nan" + zeros.substr(2)}, "2: start_xx_m2: found 'nan', expected");
  ExpectRefusedRows(name, {"100,0,-1" + zeros.substr(2)},
                    "2: start_xx_m2: found '-1', expected 0 to");
  ExpectRefusedRows(name, {"100,0,1e-6,2e-6,0,1e-6" + zeros.substr(8)},
                    "2: start_xx_m2: found '1e-6', expected columns that are a covariance");
}

TEST_F(MapFolderTest, DamagedSupportsAreNamed) {
  const std::string name = "line_supports.csv", &stamp = stamp_;
  ExpectRefusedRows(name, {"100,0," + stamp + ",0,1,2,3"}, "2: found 7 columns, expected 8");
  ExpectRefusedRows(name, {"100,0," + stamp + ",0,1,2,3,inf"},
                    "2: end_y_px: found 'inf', expected");
  ExpectRefusedRows(name, {"100,0," + stamp + ",2,1,2,3,4"},
                    "2: camera: found '2', expected 0 to 1");
  ExpectRefusedRows(name, {"7,0," + stamp + ",0,1,2,3,4"},
                    "2: line_id: found '7', expected the id of");
  ExpectRefusedRows(name, {"100,0,12,0,1,2,3,4"},
                    "2: stamp_ns: found '12', expected the stamp of a pose");
  ExpectRefusedRows(name, {"100,0," + stamp + ",0,1,2,3,4", "100,0," + stamp + ",0,1,2,3,4"},
                    "3: line_id: found '100', expected rows in the order of");
}

TEST_F(MapFolderTest, DamagedPointObservationsAreNamed) {
  const std::string name = "point_observations.csv", seen = "0,0," + stamp_ + ",0,";
  ExpectRefusedRows(name, {seen + "1"}, "2: found 5 columns, expected 6");
  ExpectRefusedRows(name, {"100000,0," + stamp_ + ",0,1,2"},
                    "2: point: found '100000', expected less than the " +
                        std::to_string(map_.points.size()) + " points");
  ExpectRefusedRows(name, {"-1,0," + stamp_ + ",0,1,2"}, "2: point: found '-1', expected");
  ExpectRefusedRows(name, {"0,1," + stamp_ + ",0,1,2"}, "2: track: found '1', expected at most 0");
  ExpectRefusedRows(name, {seen + "1,2", "0,2," + stamp_ + ",0,1,2"},
                    "3: track: found '2', expected at most 1");
  ExpectRefusedRows(name, {"0,0,12,0,1,2"},
                    "2: stamp_ns: found '12', expected the stamp of a pose");
  ExpectRefusedRows(name, {"0,0," + stamp_ + ",2,1,2"}, "2: camera: found '2', expected 0 to 1");
  ExpectRefusedRows(name, {seen + "inf,2"}, "2: x_px: found 'inf', expected");
  ExpectRefusedRows(name, {seen + "1,1e9"}, "2: y_px: found '1e9', expected");
  ExpectRefusedRows(name, {seen + "1,2", seen + "1,2"},
                    "3: point: found '0', expected rows in the order");
}

std::vector<MergedRun> ThreeRuns() {
  return {{"a", "/recordings/day", "0.1.0", 0, {}, StampSpan{100, 200}},
          {"b", "/recordings/night", "0.2.0", -3600, LevelTransform(0.5, {1, -2, 0.25}),
           StampSpan{300, 400}},
          {"c", "", "0.2.0", 0, LevelTransform(-3, {0, 1, 0}), StampSpan{-50, 99}}};
}

MapSource SourceA() {
  MapSource source;
  source.run_id = "a";
  return source;
}

TEST(MergedRuns, AreReadAsTheyWereWritten) {
  std::vector<MergedRun> runs = ThreeRuns();
  runs[1].opened.cameras = {1, 2};
  const Json json = MergedJson(runs);
  const std::vector<MergedRun> read = ParseMerged("map.json", json, SourceA());
  EXPECT_EQ(MergedJson(read), json);
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].opened.cameras, (std::vector<int>{1, 2}));
  EXPECT_TRUE(read[0].opened.cameras.empty());
  EXPECT_EQ(read[1].run_id, "b");
  EXPECT_EQ(read[1].stamps_moved_ns, -3600);
  EXPECT_EQ(read[1].poses_ns->to_ns, 400);
  EXPECT_NEAR(ComputeYaw(read[1].T_world_run), 0.5, 1e-12);
}

// The first run's map may be turned against its run.
TEST(MergedRuns, TheFirstIsTurnedAsItsMapIs) {
  MapSource source = SourceA();
  source.T_world_run = LevelTransform(0.3, Eigen::Vector3d::Zero());
  std::vector<MergedRun> runs = ThreeRuns();
  runs[0].T_world_run = source.T_world_run;
  const std::vector<MergedRun> read = ParseMerged("map.json", MergedJson(runs), source);
  EXPECT_NEAR(ComputeYaw(read[0].T_world_run), 0.3, 1e-12);
  EXPECT_THAT([&] { ParseMerged("map.json", MergedJson(ThreeRuns()), source); },
              ThrowsMessage<DataError>(HasSubstr("run 0: found it moved, expected the first run")));
}

// What is said of the list once a value in it is another.
void ExpectRefused(const std::string& pointer, const Json& value, const std::string& message) {
  Json json = MergedJson(ThreeRuns());
  json[Json::json_pointer(pointer)] = value;
  EXPECT_THAT([&] { ParseMerged("map.json", json, SourceA()); },
              ThrowsMessage<DataError>(HasSubstr("map.json: merged: " + message)))
      << pointer;
}

TEST(MergedRuns, WhatCannotBeIsNamed) {
  ExpectRefused("/1/stamps_moved_ns", 5e18,
                "run 1: stamps_moved_ns: found 5e+18, expected -4000000000000000000 to");
  ExpectRefused("/1/stamps_moved_ns", 1.5, "run 1: stamps_moved_ns: found 1.5, expected");
  ExpectRefused("/1/stamps_moved_ns", "x", "run 1: stamps_moved_ns: found \"x\", expected");
  ExpectRefused("/1/first_pose_ns", -5'000'000'000'000'000'000, "run 1: first_pose_ns: found -5");
  ExpectRefused("/1/last_pose_ns", 299, "run 1: last_pose_ns: found 299, expected 300 to");
  ExpectRefused("/2/last_pose_ns", 100, "run 2: found poses from -50 to 100 ns, expected none");
  ExpectRefused("/1/yaw_rad", 4.5, "run 1: yaw_rad: found 4.5, expected -4 to 4");
  ExpectRefused("/1/yaw_rad", nullptr, "run 1: yaw_rad: found null, expected -4 to 4");
  ExpectRefused("/1/position_m", Json{1, 2},
                "run 1: position_m: found the point [1,2], expected 3");
  ExpectRefused("/1/position_m/0", 1e7, "run 1: position_m: found the point [10000000.0,");
  ExpectRefused("/2/run", "b", "run 2: run: found b twice, expected each once");
  ExpectRefused("/0/run", "d", "run 0: run: found 'd', expected 'a' as in source");
  ExpectRefused("/0/stamps_moved_ns", 1, "run 0: found it moved, expected the first run as it was");
  ExpectRefused("/0/yaw_rad", 0.1, "run 0: found it moved, expected the first run as it was");
  ExpectRefused("/0/position_m/2", 0.1, "run 0: found it moved, expected the first run as it was");
}

TEST(MergedRuns, AreAListThatMayBeWithoutStamps) {
  Json json = MergedJson(ThreeRuns());
  for (const auto& [wrong, found] : {std::pair<Json, std::string>(nullptr, "'null'"),
                                     {"a", "'string'"},
                                     {json[0], "'object'"},
                                     {Json::array(), "0 runs"},
                                     {MergedJson({ThreeRuns()[0]}), "1 runs"}}) {
    const Json& list = wrong;
    EXPECT_EQ(MessageOf<DataError>([&] { ParseMerged("map.json", list, SourceA()); }),
              "map.json: merged: found " + found + ", expected a list of two runs or more");
  }
  json[1].erase("first_pose_ns");
  json[1].erase("last_pose_ns");
  const std::vector<MergedRun> read = ParseMerged("map.json", json, SourceA());
  EXPECT_TRUE(read[0].poses_ns.has_value());
  EXPECT_FALSE(read[1].poses_ns.has_value());
}

// A part of a run is missing, or of another type: named with the file, as everywhere.
TEST(MergedRuns, AreWhole) {
  const testing::TempFolder temp;
  const std::string folder = temp.Path("map");
  MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  const int64_t first_ns = map.trajectory.front().stamp_ns;
  const int64_t last_ns = map.trajectory.back().stamp_ns;
  map.source.run_id = "a";
  map.source.merged = {{"a", "", "", 0, {}, StampSpan{first_ns, first_ns + 2'000'000'000}},
                       {"b", "", "", 5, {}, StampSpan{first_ns + 2'100'000'000, last_ns}}};
  WriteMapFolder(folder, map);
  EXPECT_EQ(ReadMapFolder(folder).source.merged.size(), 2u);
  const Json good = Json::parse(ReadFile(folder + "/map.json"));
  const auto expect_refused = [&](const Json& json, const std::string& message) {
    WriteJsonFile(folder + "/map.json", json);
    EXPECT_THAT([&] { ReadMapFolder(folder, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr("map.json: " + message)));
  };
  for (const char* key : {"run", "slcmap", "sequence", "stamps_moved_ns", "position_m", "yaw_rad",
                          "first_pose_ns", "last_pose_ns"}) {
    Json json = good;
    json["merged"][1].erase(key);
    expect_refused(json, std::string(key) + ": missing");
  }
  Json json = good;
  json["merged"][1] = 7;
  expect_refused(json, "found a value of a wrong type");
  // A pose between those of the two runs.
  json = good;
  json["merged"][0]["last_pose_ns"] = first_ns + 1'950'000'000;
  expect_refused(json, "merged: found a pose at " + std::to_string(first_ns + 2'000'000'000) +
                           " ns that is none of any run's");
}

}  // namespace
}  // namespace slcmap
