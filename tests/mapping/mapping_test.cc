#include "mapping/mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "data/error.h"
#include "data/file.h"
#include "data/ply.h"
#include "mapping/map_folder.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const char* const kFiles[] = {"trajectory.tum", "keyframes.tum", "points.ply", "points.pcd",
                              "dense.ply",      "dense.pcd",     "lines.ply",  "marks.ply",
                              "occupancy.bt",   "rig.json",      "map.json"};

class MappingTest : public ::testing::Test {
 protected:
  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/map");
};

TEST_F(MappingTest, AWallBecomesPointsAndVoxels) {
  const MapResult map = BuildMap(testing::MakeWallRun(), {});
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
  const std::vector<MapLine> lines = BuildMap(run, {}).lines;
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
  WriteMapFolder(folder_, BuildMap(run, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_TRUE(map.trajectory.empty() && map.keyframes.empty() && map.points.empty());
  EXPECT_TRUE(map.lines.empty() && map.occupancy.OccupiedVoxels().empty());
}

// The run reports all lines that it has estimated: which become lines of the map is for mapping.
TEST_F(MappingTest, WhichLinesAreCertainEnoughIsForItsOptions) {
  OdometryRun run = testing::MakeLineRun();
  for (Line& line : run.lines) line.covariance_m2 *= 100;  // 4 cm
  for (Line& line : run.lines) line.observations = 2;
  EXPECT_TRUE(BuildMap(run, {}).lines.empty());
  MappingOptions options;
  options.run_lines.max_sigma_m = 0.05;
  EXPECT_TRUE(BuildMap(run, options).lines.empty());
  options.run_lines.min_observations = 2;
  EXPECT_EQ(BuildMap(run, options).lines.size(), run.lines.size());
}

// A run whose keyframes are on another clock than its states was refined by nothing, silently.
TEST_F(MappingTest, ARunThatCannotBeRefinedSaysSo) {
  OdometryRun run = testing::MakeWallRun();
  for (Keyframe& keyframe : run.keyframes) keyframe.stamp_ns += 20'000'000;
  WriteMapFolder(folder_, BuildMap(run, {}));
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
  WriteMapFolder(folder_, BuildMap(run, {}));
  const MapResult map = ReadMapFolder(folder_);
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "interrupted");
  EXPECT_EQ(map.warnings.at("imu_gap"), 3);
  EXPECT_GT(map.points.size(), 370u);
}

TEST_F(MappingTest, AMapThatIsEndedIsPartialAndHoldsWhatIsDone) {
  const MapResult map =
      BuildMap(testing::MakeLineRun(), {}, Progress([](double done) { return done < 0.75; }));
  EXPECT_FALSE(map.complete);
  EXPECT_EQ(map.partial_reason, "mapping was interrupted");
  EXPECT_EQ(map.trajectory.size(), 51u);
  EXPECT_GT(map.points.size(), 380u);
  EXPECT_EQ(map.lines.size(), 24u);
  EXPECT_TRUE(map.occupancy.IsFree({7.05, 0.05, 1.05}));  // as the first keyframes saw
}

TEST_F(MappingTest, ReportsHowFarItIs) {
  std::vector<double> shares;
  BuildMap(testing::MakeLineRun(), {}, Progress([&](double done) {
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
  const MapResult map = BuildMap(run, {});
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
  }
  ASSERT_EQ(read.lines.size(), map.lines.size());
  EXPECT_EQ(read.lines[23].id, 123);
  EXPECT_EQ(read.lines[23].axis, LineAxis::kY);
  EXPECT_LT((read.lines[23].end_world - map.lines[23].end_world).norm(), 1e-6);
  EXPECT_EQ(read.occupancy.OccupiedVoxels().size(), map.occupancy.OccupiedVoxels().size());
}

TEST_F(MappingTest, TheSameRunGivesTheSameBytes) {
  WriteMapFolder(folder_ + "/a", BuildMap(testing::MakeWallRun(), {}));
  WriteMapFolder(folder_ + "/b", BuildMap(testing::MakeWallRun(), {}));
  for (const std::string name : kFiles) {
    EXPECT_EQ(ReadFile(folder_ + "/a/" + name), ReadFile(folder_ + "/b/" + name)) << name;
  }
}

TEST_F(MappingTest, AFullDiskNamesTheFileAndLeavesTheOldMap) {
  const MapResult map = BuildMap(testing::MakeWallRun(), {});
  OdometryRun empty = testing::MakeWallRun();
  empty.states.clear();
  WriteMapFolder(folder_, BuildMap(empty, {}));
  {
    const testing::FileSizeLimit full(500);
    EXPECT_THAT([&] { WriteMapFolder(folder_, map); },
                ThrowsMessage<OutputError>(HasSubstr("trajectory.tum: cannot be written")));
  }
  EXPECT_TRUE(ReadMapFolder(folder_).trajectory.empty());
}

TEST_F(MappingTest, MissingAndDamagedFilesAreNamed) {
  const MapResult map = BuildMap(testing::MakeWallRun(), {});
  for (const std::string name : kFiles) {
    WriteMapFolder(folder_, map);
    std::filesystem::remove(folder_ + "/" + name);
    EXPECT_THAT([&] { ReadMapFolder(folder_); }, ThrowsMessage<DataError>(HasSubstr(name)));
    const std::string damage = "damaged";
    WriteFile(folder_ + "/" + name, damage);
    EXPECT_THAT([&] { ReadMapFolder(folder_); }, ThrowsMessage<DataError>(HasSubstr(name)));
  }
}

TEST_F(MappingTest, SaysWhereItCameFrom) {
  OdometryRun run = testing::MakeWallRun();
  run.id = "0123456789abcdef";
  run.source = {"0.1.0", "/recordings/hall", "", "", {}, {}, {}, {}};
  MappingOptions options;
  options.cloud.voxel_m = 0.25;
  const MapResult map = BuildMap(run, options);
  const std::string id = WriteMapFolder(folder_, map);
  const MapResult read = ReadMapFolder(folder_);
  EXPECT_EQ(read.id, id);
  EXPECT_EQ(read.source.run_id, "0123456789abcdef");
  EXPECT_EQ(read.source.sequence, "/recordings/hall");
  EXPECT_THAT(read.source.options, HasSubstr("mapping:\n  cloud:\n"));
  EXPECT_THAT(read.source.options, HasSubstr("    voxel_m: 0.25\n"));
  EXPECT_EQ(WriteMapFolder(folder_, map), id);
  EXPECT_NE(WriteMapFolder(folder_, BuildMap(run, {})), id);
}

TEST_F(MappingTest, ChangedFilesAreRefusedUnlessAccepted) {
  const MapResult map = BuildMap(testing::MakeWallRun(), {});
  WriteMapFolder(folder_, map);
  const std::string path = folder_ + "/points.ply", bytes = ReadFile(path);
  std::string moved = bytes;
  moved[bytes.size() - 9] ^= 1;  // of a coordinate's or sigma's bits
  WriteFile(path, moved);
  EXPECT_THAT([&] { ReadMapFolder(folder_); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("points.ply: found "), HasSubstr("--accept-changed"))));
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).points.size(), map.points.size());
  PlyFile far = ReadPly(path);
  far.elements[0].properties[0].values[2] = 1e30;
  WritePly(path, far);
  EXPECT_THAT([&] { ReadMapFolder(folder_, {.accept_changed = true}); },
              ThrowsMessage<DataError>(HasSubstr("points.ply: vertex row 3: x: found 1")));
  WriteFile(path, bytes);
  const std::string poses = folder_ + "/trajectory.tum", rows = ReadFile(poses);
  WriteFile(poses, rows.substr(0, rows.rfind('\n', rows.size() - 2) + 1));
  EXPECT_THAT([&] { ReadMapFolder(folder_); },
              ThrowsMessage<DataError>(HasSubstr("found 50 poses, expected 51 as in map.json")));
  EXPECT_EQ(ReadMapFolder(folder_, {.accept_changed = true}).trajectory.size(), 50u);
}

TEST_F(MappingTest, LinesWithoutTheirVerticesAreNamed) {
  MapResult map = BuildMap(testing::MakeWallRun(), {});
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
