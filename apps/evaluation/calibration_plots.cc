#include "apps/evaluation/calibration_plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "apps/evaluation/svg_plot.h"
#include "data/angle_unit.h"
#include "data/csv_table.h"
#include "data/file.h"
#include "odometry/run_rows.h"

namespace slcmap {
namespace {

constexpr int kNumbers = 28;  // of a row; then come their standard deviations
constexpr int kFirstColumn = 2;
constexpr std::array<const char*, 3> kColours = {"#d03020", "#20a040", "#2060c0"};
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

// Numbers of a row that are one item.
struct Item {
  const char *file, *title, *unit;
  int first, count;
  double scale;
};
constexpr std::array<Item, 8> kItems{
    {{"time_offset", "Time offset found, less what was given", "ms", 0, 1, 1e3},
     {"imu_rotation", "Turn of the IMU found, less what was given", "deg", 1, 3, kDegreesPerRadian},
     {"lever", "Lever of the IMU found, less what was given", "mm", 4, 3, 1e3},
     {"right_rotation", "Turn of the right camera found, less what was given", "deg", 7, 3,
      kDegreesPerRadian},
     {"focal_length", "Focal length found, less what was given", "%", 10, 1, 100},
     {"right_centre", "Principal point of the right camera found, less what was given", "px", 11, 2,
      1},
     {"accel_scale", "Scale of the accelerometer found, less what was given", "%", 13, 3, 100},
     {"gyro_scale", "Scale of the gyroscope found, less what was given", "%", 19, 3, 100}}};

double ValueAt(const CsvTable& table, std::size_t row, int number) {
  return table.Number(row, kFirstColumn + number);
}

double SigmaAt(const CsvTable& table, std::size_t row, int number) {
  return table.Number(row, kFirstColumn + kNumbers + number);
}

bool WasEstimated(const CsvTable& table, const Item& item) {
  for (std::size_t row = 0; row < table.rows(); ++row) {
    for (int i = item.first; i < item.first + item.count; ++i) {
      if (SigmaAt(table, row, i) > 0) return true;
    }
  }
  return false;
}

double LargestFrom(std::size_t first_row, const CsvTable& table, const Item& item) {
  double largest = 0;
  for (std::size_t row = first_row; row < table.rows(); ++row) {
    for (int i = item.first; i < item.first + item.count; ++i) {
      largest = std::max(largest, std::abs(ValueAt(table, row, i)) + SigmaAt(table, row, i));
    }
  }
  return item.scale * largest;
}

// The largest that is drawn, to either side of what was given: of all rows where an item was given
// up early.
double Limit(const CsvTable& table, const Item& item) {
  const double of_most = LargestFrom(table.rows() / 3, table, item);
  return of_most > 0 ? of_most : LargestFrom(0, table, item);
}

SvgPlot PlotOf(const CsvTable& table, const Item& item) {
  SvgPlot plot{item.title, "time [s]", std::string("correction [") + item.unit + "]", false, {}};
  const double limit = Limit(table, item);
  const auto place = [&](double value) { return std::clamp(item.scale * value, -limit, limit); };
  for (int i = 0; i < item.count; ++i) {
    const char* axis = item.count > 1 ? kAxes[i] : "found";
    SvgSeries curve{axis, kColours[i], {}},
        bars{std::string(axis) + ", sigma", kColours[i], {}, SvgStyle::kSegments};
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const double time_s = 1e-9 * static_cast<double>(table.Integer(row, 0) - table.Integer(0, 0));
      const double value = ValueAt(table, row, item.first + i);
      const double sigma = SigmaAt(table, row, item.first + i);
      curve.points.emplace_back(time_s, place(value));
      bars.points.emplace_back(time_s, place(value - sigma));
      bars.points.emplace_back(time_s, place(value + sigma));
    }
    plot.series.push_back(std::move(curve));
    plot.series.push_back(std::move(bars));
  }
  return plot;
}

}  // namespace

std::vector<std::string> WriteCalibrationPlots(const std::string& folder,
                                               const std::string& calibration_csv) {
  const CsvTable table = CsvTable::Read(calibration_csv, RunColumns().at(kCalibrationTable));
  MakeFolder(folder);
  std::vector<std::string> paths;
  for (const Item& item : kItems) {
    if (!WasEstimated(table, item)) continue;
    paths.push_back(folder + "/" + item.file + ".svg");
    WriteFile(paths.back(), DrawSvg(PlotOf(table, item)));
  }
  return paths;
}

}  // namespace slcmap
