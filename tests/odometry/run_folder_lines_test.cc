
#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "data/io/file.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/run_queries.h"
#include "tests/testing/made_run.h"
#include "tests/testing/small_run_folder.h"

namespace slcmap {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

class RunFolderLinesTest : public testing::SmallRunFolder {
 protected:
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  // Appends a row to a table that is otherwise good; reading must name the row.
  void ExpectRowError(const std::string& name, const std::string& row, const std::string& what) {
    WriteRunFolder(folder_, testing::MakeLineRun());
    const std::string good = ReadFile(Path(name));
    const auto rows = std::count(good.begin(), good.end(), '\n');
    WriteFile(Path(name), good + row + "\n");
    ExpectReadError(name + ": row " + std::to_string(rows + 1) + ":", what);
  }
};

TEST_F(RunFolderLinesTest, LinesComeBackExactly) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[0].covariance_m2 << 1e-4, 2e-5, 3e-6, 2e-5, 4e-4, 5e-7, 3e-6, 5e-7, 6e-4;
  run.lines[1].segment = 2;
  run.lines[2].start_world.x() = 1.0 / 3;
  run.lines[3].deviation_rad = 0.002;
  run.lines[3].deviation_sigma_rad = 0.0004;
  run.line_deviation_rad = 0.0033;  // was read as a whole number: 0
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  const auto values = [](const Line& line) {
    return std::tie(line.id, line.segment, line.axis, line.world, line.start_world, line.end_world,
                    line.covariance_m2, line.observations, line.last_keyframe, line.deviation_rad,
                    line.deviation_sigma_rad, line.point_ids);
  };
  ASSERT_EQ(read.lines.size(), run.lines.size());
  for (std::size_t i = 0; i < run.lines.size(); ++i) {
    EXPECT_TRUE(values(read.lines[i]) == values(run.lines[i])) << i;
  }
  EXPECT_EQ(read.lines[3].point_ids.size(), 20u);
  EXPECT_EQ(read.line_deviation_rad, 0.0033);
}

TEST_F(RunFolderLinesTest, ObservationsComeBack) {
  OdometryRun run = testing::MakeLineRun();
  run.keyframes[2].lines[1].right_px.reset();
  run.keyframes[2].lines[2].id = 999;  // never became a line
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  for (std::size_t k = 0; k < run.keyframes.size(); ++k) {
    const auto &a = read.keyframes[k].lines, &b = run.keyframes[k].lines;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].id, b[i].id);
      EXPECT_LT((a[i].left_px.start - b[i].left_px.start).norm(), 1e-4);
      EXPECT_LT((a[i].left_px.end - b[i].left_px.end).norm(), 1e-4);
      ASSERT_EQ(a[i].right_px.has_value(), b[i].right_px.has_value());
      if (a[i].right_px) {
        EXPECT_LT((a[i].right_px->end - b[i].right_px->end).norm(), 1e-4);
      }
    }
  }
  EXPECT_EQ(read.keyframes[5].lines.size(), 20u);
}

TEST_F(RunFolderLinesTest, ManhattanWorldsComeBack) {
  OdometryRun run = testing::MakeLineRun();
  run.manhattan_worlds.push_back({1, -0.5, 0.002, 1600000003123456789, true});
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  const auto values = [](const ManhattanWorld& world) {
    return std::tie(world.segment, world.heading_rad, world.sigma_rad, world.found_at_ns,
                    world.withdrawn);
  };
  ASSERT_EQ(read.manhattan_worlds.size(), 2u);
  for (const int i : {0, 1}) {
    EXPECT_EQ(values(read.manhattan_worlds[i]), values(run.manhattan_worlds[i])) << i;
  }
}

TEST_F(RunFolderLinesTest, SlopedDirectionsComeBackWithTheirLines) {
  OdometryRun run = testing::MakeLineRun();
  run.sloped_directions = {{0, 1.5, 0.5, 0.001, 0.002, 1600000003123456789, false},
                           {0, -2.5, 0.1, 0, 0.003, 5, true}};
  run.lines[3].axis = run.lines[4].axis = LineAxis::kSloped;
  run.lines[3].world = 0;
  run.lines[4].world = 1;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  ASSERT_EQ(read.sloped_directions.size(), 2u);
  const auto values = [](const SlopedDirection& slope) {
    return std::tie(slope.azimuth_rad, slope.elevation_rad, slope.azimuth_sigma_rad,
                    slope.elevation_sigma_rad, slope.found_at_ns, slope.withdrawn);
  };
  for (const int i : {0, 1}) {
    EXPECT_EQ(values(read.sloped_directions[i]), values(run.sloped_directions[i])) << i;
  }
  EXPECT_EQ(read.lines[3].axis, LineAxis::kSloped);
  const std::vector<MapLine> lines = ReadMapLines(Path("lines.ply"));
  EXPECT_EQ(lines.size(), run.lines.size() - 1) << "without that of the withdrawn one";
  EXPECT_EQ(lines[3].axis, LineAxis::kSloped);
  EXPECT_EQ(lines[3].world, 0);
}

TEST_F(RunFolderLinesTest, ALineOfASlopeThatThereIsNotIsRefused) {
  OdometryRun run = testing::MakeLineRun();
  run.sloped_directions.resize(1);
  run.lines[3].axis = LineAxis::kSloped;
  for (const int index : {-1, 1}) {
    run.lines[3].world = index;
    WriteRunFolder(folder_, run);
    ExpectReadError("lines.csv", "the index of a sloped direction");
  }
}

TEST_F(RunFolderLinesTest, PlyHoldsTheLinesForOtherPrograms) {
  OdometryRun run = testing::MakeLineRun();
  run.lines[20].deviation_rad = 0.002;
  run.lines[20].deviation_sigma_rad = 0.0004;
  WriteRunFolder(folder_, run);
  const std::vector<MapLine> lines = ReadMapLines(Path("lines.ply"));
  ASSERT_EQ(lines.size(), run.lines.size());
  EXPECT_EQ(std::tie(lines[20].id, lines[20].axis, lines[20].world),
            std::make_tuple(120, LineAxis::kY, 0));
  EXPECT_NEAR(lines[20].sigma_m, 0.004, 1e-9);
  EXPECT_NEAR(lines[20].deviation_rad, 0.002, 1e-9);
  EXPECT_NEAR(lines[20].deviation_sigma_rad, 0.0004, 1e-9);
  EXPECT_LT((lines[20].end_world - run.lines[20].end_world).norm(), 1e-6);
}

TEST_F(RunFolderLinesTest, LinesOfAWithdrawnWorldAreNoneOfTheMap) {
  OdometryRun run = testing::MakeLineRun();
  const auto of_world = std::ranges::count(run.lines, 0, &Line::world);
  ASSERT_GT(of_world, 0);
  run.manhattan_worlds[0].withdrawn = true;
  EXPECT_EQ(std::ssize(MapLines(run)), std::ssize(run.lines) - of_world);
}

TEST_F(RunFolderLinesTest, ARunWithoutLinesHasEmptyFiles) {
  WriteRunFolder(folder_, testing::MakeWallRun());
  EXPECT_TRUE(ReadMapLines(Path("lines.ply")).empty());
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_TRUE(read.lines.empty() && read.manhattan_worlds.empty());
}

TEST_F(RunFolderLinesTest, LinesFollowTheirWorldWhereOneIsDropped) {
  OdometryRun run = testing::MakeLineRun();
  run.manhattan_worlds.push_back({0, 0.5, 0.001, 5});
  run.manhattan_worlds[0].heading_rad = kNotANumber;
  run.lines[23].world = 1;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.warnings.at("manhattan_worlds_not_finite"), 1);
  ASSERT_EQ(read.manhattan_worlds.size(), 1u);
  EXPECT_EQ(read.manhattan_worlds[0].heading_rad, 0.5);
  ASSERT_EQ(read.lines.size(), 21u);  // the vertical ones, and one of the four
  EXPECT_EQ(read.lines[20].id, 123);
  EXPECT_EQ(read.lines[20].world, 0);
  EXPECT_EQ(read.lines[0].world, -1);
}

TEST_F(RunFolderLinesTest, LinesFollowTheirSlopeWhereOneIsDropped) {
  OdometryRun run = testing::MakeLineRun();
  run.sloped_directions = {{0, kNotANumber, 0.5, 0, 0, 5, false}, {0, 0.2, 0.6, 0, 0, 6, false}};
  run.lines[3].axis = run.lines[4].axis = LineAxis::kSloped;
  run.lines[3].world = 0;
  run.lines[4].world = 1;
  WriteRunFolder(folder_, run);
  const OdometryRun read = ReadRunFolder(folder_);
  EXPECT_EQ(read.warnings.at("sloped_directions_not_finite"), 1);
  ASSERT_EQ(read.sloped_directions.size(), 1u);
  ASSERT_EQ(read.lines.size(), run.lines.size() - 1);
  EXPECT_EQ(read.lines[3].id, run.lines[4].id);
  EXPECT_EQ(read.lines[3].world, 0);
  EXPECT_EQ(read.lines.back().world, run.lines.back().world) << "of a Manhattan world";
}

TEST_F(RunFolderLinesTest, DamagedRowsAreNamed) {
  const std::string ends = "0,0,0,1,1,1,", covariance = "0,0,0,0,0,0,";
  ExpectRowError("lines.csv", "7,0,5,-1," + ends + covariance + "3,5,0,0", "axis: found '5'");
  ExpectRowError("lines.csv", "7,0,1,1," + ends + covariance + "3,5,0,0", "world: found '1'");
  ExpectRowError("lines.csv", "7,0,1,-2," + ends + covariance + "3,5,0,0", "world: found '-2'");
  ExpectRowError("lines.csv", "100,0,1,0," + ends + covariance + "3,5,0,0", "id: found '100'");
  ExpectRowError("lines.csv", "7,0,1,0,0,nan,0,1,1,1," + covariance + "3,5,0,0", "start_y_m");
  ExpectRowError("lines.csv", "7,0,1,0," + ends, "found 10 columns, expected 20");
  ExpectRowError("line_points.csv", "7,3", "line_id: found '7'");
  ExpectRowError("line_observations.csv", "77,100,1,2,3,4,nan,nan,nan,nan",
                 "keyframe_id: found '77'");
  ExpectRowError("line_observations.csv", "0,100,1,2,x,4,nan,nan,nan,nan",
                 "left_end_x_px: found 'x'");
  ExpectRowError("line_observations.csv", "0,199,1,2,3,4,5,nan,nan,nan",
                 "right_start_y_px: found 'nan'");
}

}  // namespace
}  // namespace slcmap
