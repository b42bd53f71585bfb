#include "mapping/control/control_points.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <optional>
#include <set>

#include "data/core/error.h"
#include "data/io/csv.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;
using Words = std::vector<std::string_view>;

constexpr double kUsualSigma_m = 0.01;  // of points that a total station measured from a network
constexpr double kClicked_px = 1;

const Words kEasting = {"easting", "easting_m", "east", "e", "x", "x_m", "rechtswert"};
const Words kNorthing = {"northing", "northing_m", "north", "n", "y", "y_m", "hochwert"};
const Words kHeight = {"height", "height_m", "elevation", "h", "z", "z_m", "hoehe"};
const Words kDegreeColumns = {"lat", "latitude",  "latitude_deg", "lon",
                              "lng", "longitude", "longitude_deg"};

// What stands behind a field of a row of a file, whose text goes on behind it.
char MarkBehind(std::string_view field) {
  const char* at = field.data() + field.size();
  while (*at == ' ' || *at == '"') ++at;
  return *at;
}

// Whether a mark stands behind the last one, so that an empty one follows.
bool HasEmptyEnd(std::string_view last) {
  return MarkBehind(last) == ',' || MarkBehind(last) == ';';
}

// A table whose columns are found by their names, and which holds names.
class NamedTable {
 public:
  explicit NamedTable(const std::string& path) : path_(path) {
    ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
      std::vector<std::string> cells(fields.begin(), fields.end());
      if (columns_.empty()) {
        has_semicolons_ = MarkBehind(fields.front()) == ';';
        return TakeHeader(std::move(cells));
      }
      if (cells.size() + 1 == columns_.size() && HasEmptyEnd(fields.back())) cells.emplace_back();
      if (cells.size() != columns_.size()) {
        throw DataError(fmt::format("{}: row {}: found {} fields, expected {}: {}", path, row,
                                    cells.size(), columns_.size(), fmt::join(columns_, ",")));
      }
      rows_.push_back(std::move(cells));
      numbers_.push_back(row);
    });
    if (rows_.empty()) throw DataError(path + ": found no row, expected a header and points");
  }

  std::size_t size() const { return rows_.size(); }

  std::optional<std::size_t> Find(const Words& words) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (std::ranges::find(words, columns_[i]) != words.end()) return i;
    }
    return std::nullopt;
  }

  std::size_t Require(const Words& words) const {
    if (const auto column = Find(words)) return *column;
    throw DataError(fmt::format("{}: found the columns {}, expected one named {}", path_,
                                fmt::join(columns_, ","), fmt::join(words, " or ")));
  }

  const std::string& Text(std::size_t row, std::size_t column) const { return rows_[row][column]; }

  double Number(std::size_t row, std::size_t column, double least, double most) const {
    std::string text = rows_[row][column];
    if (has_semicolons_) std::ranges::replace(text, ',', '.');  // of decimals
    const auto number = ParseNumber(text);
    if (number && *number >= least && *number <= most) return *number;
    Fail(row, column, fmt::format("a number from {} to {}", least, most));
  }

  double NumberOr(double usual, std::size_t row, std::size_t column, double least,
                  double most) const {
    return rows_[row][column].empty() ? usual : Number(row, column, least, most);
  }

  int64_t Stamp(std::size_t row, std::size_t column) const {
    if (const auto stamp_ns = ParseScaledInteger(rows_[row][column], 0)) return *stamp_ns;
    Fail(row, column, "nanoseconds, as images are named");
  }

  [[noreturn]] void Fail(std::size_t row, std::size_t column, const std::string& expected) const {
    throw DataError(fmt::format("{}: row {}: {}: found '{}', expected {}", path_, numbers_[row],
                                columns_[column], rows_[row][column], expected));
  }

 private:
  void TakeHeader(std::vector<std::string> cells) {
    for (std::string& cell : cells) {
      std::ranges::transform(cell, cell.begin(), [](unsigned char c) { return std::tolower(c); });
    }
    columns_ = std::move(cells);
  }

  const std::string path_;
  bool has_semicolons_ = false;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<int> numbers_;  // of the rows in the file
};

// A function of the row: the standard deviations of its coordinates.
std::function<Vector3d(std::size_t)> FindSigmas(const NamedTable& table) {
  constexpr double kLeast_m = 1e-5, kMost_m = 1000;
  const auto all = table.Find({"sigma_m", "sigma"});
  if (all) {
    return [&table, all](std::size_t row) -> Vector3d {
      return Vector3d::Constant(table.NumberOr(kUsualSigma_m, row, *all, kLeast_m, kMost_m));
    };
  }
  const std::array<Words, 3> words = {{{"sigma_easting_m", "sigma_e_m", "sigma_x_m"},
                                       {"sigma_northing_m", "sigma_n_m", "sigma_y_m"},
                                       {"sigma_height_m", "sigma_h_m", "sigma_z_m"}}};
  std::array<std::optional<std::size_t>, 3> columns;
  for (std::size_t i = 0; i < 3; ++i) columns[i] = table.Find(words[i]);
  return [&table, columns](std::size_t row) {
    Vector3d sigma_m = Vector3d::Constant(kUsualSigma_m);
    for (std::size_t i = 0; i < 3; ++i) {
      if (columns[i]) {
        sigma_m[static_cast<Eigen::Index>(i)] =
            table.NumberOr(kUsualSigma_m, row, *columns[i], kLeast_m, kMost_m);
      }
    }
    return sigma_m;
  };
}

}  // namespace

std::vector<ControlPoint> ReadControlPoints(const std::string& path) {
  constexpr double kMost_m = 1e8;  // beyond any grid
  const NamedTable table(path);
  if (table.Find(kDegreeColumns)) {
    throw DataError(path +
                    ": found a column of latitudes or longitudes, expected easting, northing and "
                    "height in metres: give coordinates in a projected system, such as the UTM "
                    "zone's, and name it with --crs");
  }
  const std::size_t name = table.Require({"name", "id", "point", "tag"});
  const std::array<std::size_t, 3> columns = {table.Require(kEasting), table.Require(kNorthing),
                                              table.Require(kHeight)};
  const auto find_sigma = FindSigmas(table);
  std::vector<ControlPoint> points;
  std::set<std::string> known;
  for (std::size_t row = 0; row < table.size(); ++row) {
    ControlPoint point{.name = table.Text(row, name), .sigma_m = find_sigma(row)};
    if (point.name.empty() || !known.insert(point.name).second) {
      table.Fail(row, name, "a name that no other point has");
    }
    for (int i = 0; i < 3; ++i) {
      point.p_m[i] = table.Number(row, columns[static_cast<std::size_t>(i)], -kMost_m, kMost_m);
    }
    points.push_back(std::move(point));
  }
  return points;
}

std::vector<Sighting> ReadMarks(const std::string& path) {
  constexpr double kMost_px = 1e5;
  const NamedTable table(path);
  const std::size_t name = table.Require({"name", "id", "point"}),
                    stamp = table.Require({"stamp_ns"}), camera = table.Require({"camera"}),
                    x = table.Require({"x_px"}), y = table.Require({"y_px"});
  std::vector<Sighting> marks;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const double number = table.Number(row, camera, 0, 1);
    if (number != 0 && number != 1) table.Fail(row, camera, "0 (left) or 1 (right)");
    marks.push_back({table.Text(row, name),
                     table.Stamp(row, stamp),
                     static_cast<int>(number),
                     {table.Number(row, x, -1, kMost_px), table.Number(row, y, -1, kMost_px)},
                     kClicked_px});
  }
  return marks;
}

KnownDistance ParseDistance(const std::string& text) {
  const std::vector<std::string> parts = SplitAtCommas(text);
  const bool is_whole = (parts.size() == 3 || parts.size() == 4) && parts[0] != parts[1];
  const auto metres = is_whole ? ParseNumber(parts[2]) : std::nullopt;
  KnownDistance distance;
  const auto sigma_m =
      is_whole && parts.size() == 4 ? ParseNumber(parts[3]) : std::optional(distance.sigma_m);
  if (metres && *metres > 0 && *metres < 1e5 && sigma_m && *sigma_m > 0 && *sigma_m < *metres) {
    return {parts[0], parts[1], *metres, *sigma_m};
  }
  throw ConfigError(fmt::format(
      "--distance: found '{}', expected two points, the metres between them, and perhaps how well "
      "they are known (0.003 where that is left out): NAME1,NAME2,METRES,SIGMA_M",
      text));
}

std::vector<std::string> ListNames(const Control& control) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  };
  for (const ControlPoint& point : control.points) add(point.name);
  for (const KnownDistance& distance : control.distances) {
    add(distance.from);
    add(distance.to);
  }
  return names;
}

}  // namespace slcmap::mapping
