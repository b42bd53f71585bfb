#include "mapping/mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/ply.h"
#include "mapping/map/evidence_files.h"
#include "mapping/map/map_folder.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/made_building.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const char* const kFiles[] = {"trajectory.tum",    "keyframes.tum",
                              "points.ply",        "points.pcd",
                              "dense.ply",         "dense.pcd",
                              "lines.ply",         "marks.ply",
                              "occupancy.bt",      "rig.json",
                              "map.json",          "line_covariances.csv",
                              "line_supports.csv", "point_observations.csv"};

class MappingTest : public ::testing::Test {
 protected:
  // Reading must fail with a message that holds this.
  void ExpectReadError(const std::string& what, bool accept_changed = false) const {
    EXPECT_THAT([&] { ReadMapFolder(folder_, {.accept_changed = accept_changed}); },
                ThrowsMessage<DataError>(HasSubstr(what)));
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/map");
};

TEST_F(MappingTest, AWallBecomesPointsAndVoxels) {
  MappingOptions options;
  options.occupancy.resolution_m = 0.1;
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, options);
  EXPECT_TRUE(map.complete);
  EXPECT_EQ(map.trajectory.size(), 51u);
  EXPECT_EQ(map.keyframes.size(), 6u);
  EXPECT_GT(map.points.size(), 380u);
  for (const MapPoint& point : map.points) EXPECT_NEAR(point.p_world.x(), 10.02, 1e-12);
  EXPECT_GT(map.occupancy.OccupiedVoxels().size(), 300u);
  for (const Voxel& voxel : map.occupancy.OccupiedVoxels()) {
    EXPECT_NEAR(voxel.centre_world.x(), 10.05, 1e-5);
  }
  EXPECT_TRUE(map.occupancy.IsFree({7.05, 0.05, 1.05}));
}

TEST_F(MappingTest, CertainLinesBecomeLinesOfTheMap) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[0].covariance_m2 *= 100;                  // 4 cm
  run.lines[1].end_world = run.lines[1].start_world;  // no extent
  run.lines[2].observations = 3;                      // seen too seldom
  run.lines[3].covariance_m2.setConstant(std::nan(""));
  const std::vector<MapLine> lines = MapRun(run, nullptr, {}).lines;
  ASSERT_EQ(lines.size(), 20u);
  EXPECT_EQ(lines[0].id, 104);
  EXPECT_EQ(lines[0].axis, LineAxis::kVertical);
  EXPECT_EQ(lines[19].axis, LineAxis::kY);
  EXPECT_EQ(lines[19].world, 0);
  EXPECT_NEAR(lines[19].sigma_m, 0.004, 1e-9);
  EXPECT_EQ(lines[19].observations, run.lines[23].observations);
  EXPECT_EQ(lines[19].end_world, run.lines[23].end_world);
}

TEST_F(MappingTest, AnEmptyRunMakesAnEmptyMapThatComesBack) {
  OdometryRun run = testing::MakeWallRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
  WriteMapFolder(folder_, MapRun(run, nullptr, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_TRUE(map.trajectory.empty() && map.keyframes.empty() && map.points.empty());
  EXPECT_TRUE(map.lines.empty() && map.occupancy.OccupiedVoxels().empty());
}

// The run reports all lines that it has estimated: which become lines of the map is for mapping.
TEST_F(MappingTest, WhichLinesAreCertainEnoughIsForItsOptions) {
  OdometryRun run = testing::MakeLineRun();
  for (Line& line : run.lines) line.covariance_m2 *= 100;  // 4 cm
  for (Line& line : run.lines) line.observations = 2;
  EXPECT_TRUE(MapRun(run, nullptr, {}).lines.empty());
  MappingOptions options;
  options.run_lines.max_sigma_m = 0.05;
  EXPECT_TRUE(MapRun(run, nullptr, options).lines.empty());
  options.run_lines.min_observations = 2;
  EXPECT_EQ(MapRun(run, nullptr, options).lines.size(), run.lines.size());
}

// A run whose keyframes are on another clock than its states was refined by nothing, silently.
TEST_F(MappingTest, ARunThatCannotBeRefinedSaysSo) {
  OdometryRun run = testing::MakeWallRun();
  for (Keyframe& keyframe : run.keyframes) keyframe.stamp_ns += 20'000'000;
  WriteMapFolder(folder_, MapRun(run, nullptr, {}));
  const auto warnings = ReadMapFolder(folder_).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings.begin()->first, HasSubstr("poses not refined"));
  EXPECT_EQ(warnings.begin()->second, std::ssize(run.states));
}

TEST_F(MappingTest, APartialRunMakesAPartialMap) {
  OdometryRun run = testing::MakeWallRun();
  run.complete = false;
  run.partial_reason = "interrupted";
  run.warnings["imu_gap"] = 3;
  run.landmarks[5].p_world.x() = std::numeric_limits<double>::quiet_NaN();
  WriteMapFolder(folder_, MapRun(run, nullptr, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "interrupted");
  EXPECT_EQ(map.warnings.at("imu_gap"), 3);
  EXPECT_GT(map.points.size(), 370u);
}

TEST_F(MappingTest, AMapThatIsEndedIsPartialAndHoldsWhatIsDone) {
  const MapResult map = MapRun(testing::MakeLineRun(), nullptr, {}, {},
                               Progress([](double done) { return done < 0.75; }));
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "mapping was interrupted before the occupancy");
  EXPECT_EQ(map.trajectory.size(), 51u);
  EXPECT_GT(map.points.size(), 380u);
  EXPECT_EQ(map.lines.size(), 24u);
  EXPECT_TRUE(map.occupancy.IsFree({7.05, 0.05, 1.05}));  // as the first keyframes saw
}

TEST_F(MappingTest, ReportsHowFarItIs) {
  std::vector<double> shares;
  MapRun(testing::MakeLineRun(), nullptr, {}, {}, Progress([&](double done) {
           shares.push_back(done);
           return true;
         }));
  EXPECT_GT(shares.size(), 5u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0);
  EXPECT_LE(shares.back(), 1);
}

TEST_F(MappingTest, AMapComesBackFromItsFolder) {
  OdometryRun run = testing::MakeLineRun();
  run.verdict.emplace().Add({VerdictLevel::kDoubtful, "speed", "a", "b", "c"});
  const MapResult map = MapRun(run, nullptr, {});
  WriteMapFolder(folder_, map);
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_EQ(read.method, "points");
  EXPECT_EQ(read.rectified_rig.cameras[0].fx_px, 320);
  ASSERT_TRUE(read.verdict.has_value());
  EXPECT_EQ(read.verdict->level, VerdictLevel::kDoubtful);
  EXPECT_EQ(read.verdict->reasons.at(0).what, "speed");
  ASSERT_EQ(read.trajectory.size(), map.trajectory.size());
  EXPECT_EQ(read.keyframes.back().stamp_ns, map.keyframes.back().stamp_ns);
  ASSERT_EQ(read.points.size(), map.points.size());
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    EXPECT_LT((read.points[i].p_world - map.points[i].p_world).norm(), 1e-5);
    EXPECT_EQ(read.points[i].observations, map.points[i].observations);
    EXPECT_NEAR(read.points[i].sigma_m, map.points[i].sigma_m, 1e-6);
    EXPECT_EQ(read.points[i].line_id, map.points[i].line_id);
  }
  ASSERT_EQ(read.lines.size(), map.lines.size());
  EXPECT_EQ(read.lines[23].id, 123);
  EXPECT_EQ(read.lines[23].axis, LineAxis::kY);
  EXPECT_LT((read.lines[23].end_world - map.lines[23].end_world).norm(), 1e-6);
  EXPECT_EQ(read.occupancy.OccupiedVoxels().size(), map.occupancy.OccupiedVoxels().size());
}

TEST_F(MappingTest, HowMuchOfWhatWasSeenItHoldsComesBack) {
  MapResult map = MapRun(testing::MakeLineRun(), nullptr, {});
  EXPECT_FALSE(map.seen_share);
  map.building = testing::MakeBuilding();
  map.seen_share = 0.75;
  map.building.rooms[0].seen_share = 0.5;
  map.building.walls[2].seen_share = 0.25;
  WriteMapFolder(folder_, map);
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_EQ(read.seen_share, 0.75);
  EXPECT_EQ(read.building.rooms[0].seen_share, 0.5);
  EXPECT_FALSE(read.building.walls[1].seen_share);
  EXPECT_EQ(read.building.walls[2].seen_share, 0.25);
  map.building.walls[2].seen_share = 1.5;
  WriteMapFolder(folder_, map);
  ExpectReadError("seen_share: found 1.5, expected 0 to 1");
}

TEST_F(MappingTest, PointsOfLinesThatAreNotThereAreRefused) {
  MapResult map = MapRun(testing::MakeLineRun(), nullptr, {});
  map.points[1].line_id = 1000;
  WriteMapFolder(folder_, map);
  ExpectReadError("points.ply: vertex row 2: found line_id 1000");
}

TEST_F(MappingTest, TheSameRunGivesTheSameBytes) {
  WriteMapFolder(folder_ + "/a", MapRun(testing::MakeWallRun(), nullptr, {}));
  WriteMapFolder(folder_ + "/b", MapRun(testing::MakeWallRun(), nullptr, {}));
  for (const std::string name : kFiles) {
    EXPECT_EQ(ReadFile(folder_ + "/a/" + name), ReadFile(folder_ + "/b/" + name)) << name;
  }
}

TEST_F(MappingTest, AFullDiskNamesTheFileAndLeavesTheOldMap) {
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  OdometryRun empty = testing::MakeWallRun();
  empty.states.clear();
  WriteMapFolder(folder_, MapRun(empty, nullptr, {}));
  {
    const testing::FileSizeLimit full(500);
    EXPECT_THAT([&] { WriteMapFolder(folder_, map); },
                ThrowsMessage<OutputError>(HasSubstr("trajectory.tum: cannot be written")));
  }
  EXPECT_TRUE(ReadMapFolder(folder_).trajectory.empty());
}

TEST_F(MappingTest, MissingAndDamagedFilesAreNamed) {
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  for (const std::string name : kFiles) {
    std::filesystem::remove_all(folder_);  // what is no summary any more is not replaced
    WriteMapFolder(folder_, map);
    std::filesystem::remove(folder_ + "/" + name);
    ExpectReadError(name);
    const std::string damage = "damaged";
    WriteFile(folder_ + "/" + name, damage);
    ExpectReadError(name);
  }
}

TEST_F(MappingTest, SaysWhereItCameFrom) {
  OdometryRun run = testing::MakeWallRun();
  run.id = "0123456789abcdef";
  run.source = {"0.1.0", "/recordings/hall", "", "", {}, {}, {}, {}};
  MappingOptions options;
  options.cloud.voxel_m = 0.25;
  const MapResult map = MapRun(run, nullptr, options);
  const std::string id = WriteMapFolder(folder_, map);
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_EQ(read.id, id);
  EXPECT_EQ(read.source.run_id, "0123456789abcdef");
  EXPECT_EQ(read.source.sequence, "/recordings/hall");
  EXPECT_THAT(read.source.options, HasSubstr("\n  cloud:\n"));
  EXPECT_THAT(read.source.options, HasSubstr("    voxel_m: 0.25\n"));
  EXPECT_EQ(WriteMapFolder(folder_, map), id);
  EXPECT_NE(WriteMapFolder(folder_, MapRun(run, nullptr, {})), id);
}

TEST_F(MappingTest, ChangedFilesAreRefusedUnlessAccepted) {
  const MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  WriteMapFolder(folder_, map);
  const std::string path = folder_ + "/points.ply", bytes = ReadFile(path);
  std::string moved = bytes;
  moved[bytes.size() - 13] ^= 1;  // of a coordinate's bits
  WriteFile(path, moved);
  EXPECT_THAT([&] { ReadMapFolder(folder_); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("points.ply: found "), HasSubstr("--accept-changed"))));
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).points.size(), map.points.size());
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

TEST_F(MappingTest, CountsThatAreMissingAreNamed) {
  OdometryRun run = testing::MakeWallRun();
  run.states.clear();
  run.keyframes.clear();
  run.landmarks.clear();
  WriteMapFolder(folder_, MapRun(run, nullptr, {}));
  const std::string path = folder_ + "/map.json";
  const Json good = Json::parse(ReadFile(path));
  for (const auto& [what, count] : good.at("counts").items()) {
    ASSERT_EQ(count, 0) << what;
    Json json = good;
    json["counts"].erase(what);
    json.erase("id");
    json.erase("checksum");
    WriteSummaryFile(path, json);
    ExpectReadError("map.json: " + what + ": missing");
  }
}

class LineTablesTest : public MappingTest {
 protected:
  LineTablesTest() { WriteMapFolder(folder_, map_); }

  // Puts other rows into the place of the first ones behind the header.
  void Replace(const std::string& name, const std::vector<std::string>& rows) const {
    std::istringstream text(original_.at(name));
    std::string damaged, row;
    for (std::size_t i = 0; std::getline(text, row); ++i) {
      damaged += (i > 0 && i <= rows.size() ? rows[i - 1] : row) + "\n";
    }
    WriteFile(folder_ + "/" + name, damaged);
  }

  // What is said of it, whether or not changes are accepted.
  void ExpectRefused(const std::string& name, const std::vector<std::string>& rows,
                     const std::string& message) const {
    Replace(name, rows);
    for (const bool accept : {false, true}) ExpectReadError(name + ": row " + message, accept);
    WriteFile(folder_ + "/" + name, original_.at(name));
  }

  const MapResult map_ = MapRun(testing::MakeLineRun(), nullptr, {});
  std::map<std::string, std::string> original_;

  void SetUp() override {
    for (const std::string& name : LineEvidenceFiles()) {
      original_[name] = ReadFile(folder_ + "/" + name);
    }
  }
};

TEST_F(LineTablesTest, ComesBack) {
  const LineEvidence read = ReadMapFolder(folder_).line_evidence;
  const LineEvidence& written = map_.line_evidence;
  ASSERT_EQ(read.covariances.size(), 24u);
  for (std::size_t i = 0; i < 24; ++i) {
    const LineCovariance &a = read.covariances[i], &b = written.covariances[i];
    EXPECT_EQ(a.line_id, 100 + static_cast<int64_t>(i));
    EXPECT_LT((a.start_m2 - b.start_m2).norm(), 1e-5 * b.start_m2.norm());
    EXPECT_LT((a.end_m2 - b.end_m2).norm(), 1e-5 * b.end_m2.norm());
    EXPECT_LT((a.start_end_m2 - b.start_end_m2).norm(), 1e-5 * b.start_m2.norm());
  }
  // Both images of the first four keyframes, and the vertical ones in that at 5 s.
  ASSERT_EQ(read.supports.size(), 2 * (4 * 24 + 20u));
  const OdometryRun run = testing::MakeLineRun();
  const LineSupport& support = read.supports[1];
  EXPECT_EQ(support.line_id, 100);
  EXPECT_EQ(support.stamp_ns, run.keyframes[0].stamp_ns);
  EXPECT_EQ(support.camera, 1);
  EXPECT_LT((support.px.end - run.keyframes[0].lines[0].right_px->end).norm(), 0.01);
}

// What the run does not know of a line's direction is not made up.
TEST_F(LineTablesTest, LinesOfUnknownDirectionHaveNoCovariance) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[2].deviation_sigma_rad = kUnknownSigma_rad;
  run.lines[3].axis = LineAxis::kNone;
  run.lines[4].deviation_sigma_rad = 0.01;
  run.lines[5].deviation_sigma_rad = 9e8;
  run.lines[6].covariance_m2(0, 0) = -1e-5;
  const LineEvidence evidence = MapRun(run, nullptr, {}).line_evidence;
  ASSERT_EQ(evidence.covariances.size(), 20u);
  const LineCovariance& turning = evidence.covariances[2];
  EXPECT_EQ(turning.line_id, 104);
  const double half_m = 0.5 * (run.lines[4].end_world - run.lines[4].start_world).norm();
  EXPECT_NEAR(turning.end_m2(0, 0), run.lines[4].covariance_m2(0, 0) + 1e-4 * half_m * half_m,
              1e-9);
  EXPECT_NEAR(turning.end_m2(2, 2), 0, 1e-12);  // it is vertical
}

TEST_F(LineTablesTest, DamagedCovariancesAreNamed) {
  const std::string name = "line_covariances.csv",
                    zeros = ",0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0";
  ExpectRefused(name, {"100,0,1e-6,0"}, "2: found 4 columns, expected 23");
  ExpectRefused(name, {"100,0" + zeros, "99,0" + zeros},
                "3: line_id: found '99', expected the id of a line in lines.ply or marks.ply");
  ExpectRefused(name, {"100,0" + zeros, "100,0" + zeros}, "3: line_id: found '100', expected rows");
  ExpectRefused(name, {"100,1" + zeros}, "2: piece: found '1', expected less than the 1 pieces");
  ExpectRefused(name, {"100,0,nan" + zeros.substr(2)}, "2: start_xx_m2: found 'nan', expected");
  ExpectRefused(name, {"100,0,-1" + zeros.substr(2)}, "2: start_xx_m2: found '-1', expected 0 to");
  ExpectRefused(name, {"100,0,1e-6,2e-6,0,1e-6" + zeros.substr(8)},
                "2: start_xx_m2: found '1e-6', expected columns that are a covariance");
}

TEST_F(LineTablesTest, DamagedSupportsAreNamed) {
  const std::string name = "line_supports.csv", stamp = std::to_string(map_.keyframes[0].stamp_ns);
  ExpectRefused(name, {"100,0," + stamp + ",0,1,2,3"}, "2: found 7 columns, expected 8");
  ExpectRefused(name, {"100,0," + stamp + ",0,1,2,3,inf"}, "2: end_y_px: found 'inf', expected");
  ExpectRefused(name, {"100,0," + stamp + ",2,1,2,3,4"}, "2: camera: found '2', expected 0 to 1");
  ExpectRefused(name, {"7,0," + stamp + ",0,1,2,3,4"}, "2: line_id: found '7', expected the id of");
  ExpectRefused(name, {"100,0,12,0,1,2,3,4"},
                "2: stamp_ns: found '12', expected the stamp of a pose");
  ExpectRefused(name, {"100,0," + stamp + ",0,1,2,3,4", "100,0," + stamp + ",0,1,2,3,4"},
                "3: line_id: found '100', expected rows in the order of");
}

TEST_F(LineTablesTest, ChangedTablesAreRefusedUnlessAccepted) {
  Replace("line_supports.csv",
          {"100,0," + std::to_string(map_.keyframes[0].stamp_ns) + ",0,1,2,3,4"});
  ExpectReadError("line_supports.csv: found ");
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).line_evidence.supports[0].px.end.y(),
            4);
  std::string rows = original_.at("line_supports.csv");
  rows.erase(rows.rfind('\n', rows.size() - 2) + 1);
  WriteFile(folder_ + "/line_supports.csv", rows);
  ExpectReadError("found 231 line_supports, expected 232");
}

TEST_F(MappingTest, LinesWithoutTheirVerticesAreNamed) {
  MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  WriteMapFolder(folder_, map);
  WriteFile(folder_ + "/lines.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
            "property float z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
            "end_header\n0 0 0\n0 1\n");
  EXPECT_THAT(
      [&] { ReadMapFolder(folder_); },
      ThrowsMessage<DataError>(AllOf(HasSubstr("lines.ply: edge row 1"), HasSubstr("vertex2 1"))));
}

}  // namespace
}  // namespace slcmap
