#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "apps/evaluation/trajectory_report.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "odometry/run/run_rows.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The time offset, the focal length and a principal point get better known with each of the rows.
std::string Table(int rows) {
  std::string text = CsvHeader(RunColumns().at(kCalibrationTable)) + "\n";
  for (int i = 0; i < rows; ++i) {
    CalibrationEstimate estimate;
    estimate.stamp_ns = int64_t{1'000'000'000} * (i + 1);
    estimate.time_offset_s = 1e-3;
    estimate.time_offset_sigma_s = 0.015 / (i + 1);
    estimate.focal_length = -0.003;
    estimate.focal_length_sigma = 0.002 / (i + 1);
    estimate.right_centre_px = {1.5, -0.5};
    estimate.right_centre_sigma_px = Eigen::Vector2d::Constant(1.0 / (i + 1));
    text += Row(estimate);
  }
  return text;
}

TEST(CalibrationPlots, ShowWhatWasEstimated) {
  const testing::TempFolder temp;
  WriteFile(temp.Path("calibration.csv"), Table(30));
  const std::string folder = temp.Path("plots");
  ASSERT_THAT(WriteCalibrationPlots(folder, temp.Path("calibration.csv")),
              ElementsAre(folder + "/time_offset.svg", folder + "/focal_length.svg",
                          folder + "/right_centre.svg"));
  EXPECT_THAT(ReadFile(folder + "/right_centre.svg"), HasSubstr("correction [px]"));
  const std::string svg = ReadFile(folder + "/time_offset.svg");
  EXPECT_THAT(svg, HasSubstr("correction [ms]"));
  EXPECT_THAT(svg, HasSubstr("found, sigma"));
  // Bars of the first rows, of 15 ms, end at the border: 2.4 ms in the last two thirds.
  EXPECT_THAT(svg, HasSubstr("\"end\">2<"));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("\"end\">10<")));
}

TEST(CalibrationPlots, AnEmptyTableHasNoneAndADamagedOneIsNamed) {
  const testing::TempFolder temp;
  WriteFile(temp.Path("calibration.csv"), Table(0));
  EXPECT_THAT(WriteCalibrationPlots(temp.Path("plots"), temp.Path("calibration.csv")),
              ::testing::IsEmpty());
  WriteFile(temp.Path("calibration.csv"), "a,b\n");
  EXPECT_THAT([&] { WriteCalibrationPlots(temp.Path("plots"), temp.Path("calibration.csv")); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("calibration.csv")));
}

}  // namespace
}  // namespace slcmap
