#include "apps/evaluation/trajectory_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/evaluation/report.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// 100 poses along a line at 10 Hz; the estimate is 3 cm off sideways, left and right in turn.
TrajectoryMetrics MakeMetrics(std::size_t estimated) {
  Trajectory truth, estimate;
  for (int i = 0; i < 100; ++i) {
    truth.push_back({ToNanoseconds(0.1 * i), {Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}}});
    estimate.push_back(truth.back());
    estimate.back().T_world_imu.translation.z() += i % 2 == 0 ? 0.03 : -0.03;
  }
  estimate.resize(estimated);
  return EvaluateTrajectory(truth, estimate, {}, {});
}

TEST(TrajectoryReport, TableHoldsTheFigures) {
  const std::string table = TrajectoryTable({"truth.csv", "run.tum", ""}, MakeMetrics(100));
  EXPECT_THAT(table, HasSubstr("posyaw     0.0300   0.0300   0.0300   0.0300    0.303    0.000"));
  EXPECT_THAT(table, HasSubstr("coverage  100.00 % of the stamps of the truth"));
  EXPECT_THAT(table, HasSubstr("poses     100 (100 with a truth), in 1 piece\n"));
  EXPECT_THAT(table, Not(HasSubstr("FLAGGED")));
  EXPECT_THAT(table, HasSubstr("heading   0.000 deg off at the end"));
  EXPECT_THAT(table, Not(HasSubstr("loop")));
}

TEST(TrajectoryReport, LowCoverageIsFlagged) {
  const EvaluationInputs inputs{
      .truth = "truth.csv", .estimate = "run.tum", .stamps = "cam0/data.csv"};
  const TrajectoryMetrics metrics = MakeMetrics(60);
  EXPECT_THAT(TrajectoryTable(inputs, metrics), HasSubstr("FLAGGED"));
  const nlohmann::ordered_json json = TrajectoryJson(inputs, metrics);
  EXPECT_TRUE(json["coverage"]["flagged"]);
  EXPECT_EQ(json["coverage"]["overall"], 0.6);
  EXPECT_EQ(json["coverage"]["stamps"], "cam0/data.csv");
}

TEST(TrajectoryReport, JsonHoldsTheFigures) {
  const nlohmann::ordered_json json =
      TrajectoryJson({"truth.csv", "run.tum", ""}, MakeMetrics(100));
  EXPECT_NEAR(json["ape"]["posyaw"]["position_m"]["rmse"].get<double>(), 0.03, 1e-9);
  EXPECT_EQ(json["ape"]["sim3"]["alignment"].size(), 3u);
  EXPECT_EQ(json["rpe"][1]["length_m"], 5);
  EXPECT_EQ(json["rpe"][2]["pieces"], 0);
  EXPECT_TRUE(json["loop"].is_null());
  EXPECT_EQ(json["heading_error_at_end_deg"], 0);
}

TEST(TrajectoryReport, PlotsAreWrittenAndAFullDiskIsNamed) {
  const testing::TempFolder temp;
  const std::string folder = temp.Path("plots");
  const std::vector<std::string> paths = WriteTrajectoryPlots(folder, MakeMetrics(100));
  ASSERT_EQ(paths.size(), 3u);
  for (const std::string& path : paths) {
    EXPECT_THAT(ReadFile(path),
                ::testing::AllOf(::testing::StartsWith("<svg"), HasSubstr("polyline")));
  }
  std::filesystem::remove(folder + "/side.svg");
  std::filesystem::create_symlink("/dev/full", folder + "/side.svg");
  EXPECT_THAT([&] { WriteTrajectoryPlots(folder, MakeMetrics(100)); },
              ::testing::ThrowsMessage<OutputError>(HasSubstr("side.svg")));
}

TEST(SvgPlot, PlacesPointsByScaleWithYUpwards) {
  // Of the page's 710 x 505 plotting area, the height limits this square.
  const std::string svg = DrawSvg({"t", "x", "y", true, {{"a < b", "#123456", {{0, 0}, {1, 1}}}}});
  EXPECT_THAT(svg, HasSubstr("points=\"195.45,522.05 654.55,62.95 \""));
  EXPECT_THAT(svg, HasSubstr("a &lt; b"));
}

TEST(SvgPlot, SegmentsAreDrawnApart) {
  const SvgSeries series{"s", "red", {{0, 0}, {1, 1}, {0, 1}, {0, 1}}, SvgStyle::kSegments};
  EXPECT_THAT(DrawSvg({"t", "x", "y", true, {series}}),
              HasSubstr("d=\"M195.45,522.05L654.55,62.95M195.45,62.95L195.45,62.95\""));
}

TEST(SvgPlot, EmptyAndFlatSeriesAreDrawn) {
  EXPECT_THAT(DrawSvg({"t", "x", "y", true, {{"none", "red", {}}}}), HasSubstr("</svg>"));
  const std::string flat = DrawSvg({"t", "x", "y", false, {{"flat", "red", {{0, 2}, {9, 2}}}}});
  EXPECT_THAT(flat, Not(HasSubstr("nan")));
  EXPECT_THAT(flat, Not(HasSubstr("inf")));
}

// Ten million poses would make a page of hundreds of megabytes.
TEST(SvgPlot, OfALongCurveOnlyWhatShowsIsDrawn) {
  SvgSeries curve{"long", "#123456", {}};
  for (int i = 0; i < 500000; ++i) curve.points.emplace_back(i, i == 123456 ? 7 : i % 2);
  const std::string svg = DrawSvg({"t", "x", "y", false, {curve}});
  EXPECT_LT(svg.size(), 1000000u);
  // The peak is at the upper end of the data, 5 % of its range below that of the page.
  EXPECT_THAT(svg, HasSubstr(",62.95 "));
}

}  // namespace
}  // namespace slcmap
