#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "data/external/readers.h"
#include "data/io/csv.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector3d;
using NumberRow = std::vector<double>;

bool IsWholeNumber(double value) { return std::abs(value) < 1e9 && value == std::floor(value); }

Vector3d PlaceIn(const NumberRow& row, size_t from) {
  return {row[from], row[from + 1], row[from + 2]};
}

// Rows of numbers; one of words at the start is a header.
std::vector<NumberRow> ParseNumberRows(const std::string& path, std::string_view bytes) {
  std::vector<NumberRow> rows;
  int64_t unreadable = 0;
  std::string first;
  ForEachTextRow(bytes, [&](int number, std::string_view text) {
    NumberRow row;
    for (const std::string_view field : SplitRow(text)) {
      const auto value = ParseNumber(field);
      if (!value) {
        if (number > 1 && unreadable++ == 0) {
          first = fmt::format("row {}: found '{}'", number, text.substr(0, 60));
        }
        return;
      }
      row.push_back(*value);
    }
    if (!row.empty()) rows.push_back(std::move(row));
  });
  if (unreadable > 0) {
    throw DataError(fmt::format(
        "{}: {}{}, expected rows of numbers: X Y Z of points, X Y Z X Y Z of segments, or what "
        "limap or Line3D++ write",
        path, first, unreadable > 1 ? fmt::format(" (and {} more)", unreadable - 1) : ""));
  }
  return rows;
}

// limap's alltracks.txt: a count, then of each track "id pieces images", both ends, image ids, line
// ids. Line3D++ has the pieces of an edge in one row: "n, n times both ends, m, m times camera,
// segment, x y x y".

bool IsLimapText(const std::vector<NumberRow>& rows) {
  return rows.size() >= 4 && rows[0].size() == 1 && rows[1].size() == 3 && rows[2].size() == 3 &&
         rows[3].size() == 3 &&
         (rows[1][1] == 0 ||
          (rows.size() >= 6 && static_cast<double>(rows[4].size()) == rows[1][1]));
}

ExternalMap FromLimap(const std::string& path, const std::vector<NumberRow>& rows) {
  ExternalMap map;
  map.format = "limap's tracks, text";
  size_t at = 1;
  while (at + 2 < rows.size()) {
    if (rows[at].size() != 3 || rows[at + 1].size() != 3 || rows[at + 2].size() != 3) break;
    map.lines.push_back({PlaceIn(rows[at + 1], 0), PlaceIn(rows[at + 2], 0)});
    at += rows[at][1] == 0 ? 3 : 5;  // of no pieces the last two rows are empty
  }
  const double expected = rows[0][0];
  if (static_cast<double>(map.lines.size()) != expected || at != rows.size()) {
    throw DataError(fmt::format("{}: cut short or mixed up: found {} tracks of limap, expected {}",
                                path, map.lines.size(), expected));
  }
  return map;
}

bool IsLine3DRow(const NumberRow& row) {
  if (row.size() < 8 || !IsWholeNumber(row[0]) || row[0] < 1 || row[0] > 1e6) return false;
  const size_t support = 1 + 6 * static_cast<size_t>(row[0]);
  if (row.size() <= support || !IsWholeNumber(row[support]) || row[support] < 0) return false;
  return static_cast<double>(row.size() - support - 1) == 6 * row[support];
}

ExternalMap FromLine3D(const std::vector<NumberRow>& rows) {
  ExternalMap map;
  map.format = "Line3D++'s text";
  for (const NumberRow& row : rows) {
    for (size_t i = 0; i < static_cast<size_t>(row[0]); ++i) {
      map.lines.push_back({PlaceIn(row, 1 + 6 * i), PlaceIn(row, 4 + 6 * i)});
    }
  }
  return map;
}

// Whether six columns are points with colours, to 255 or to 1, or with normals, which may be
// missing; not segments, of which both ends are places of one kind.
bool IsPointWithMore(const std::vector<NumberRow>& rows) {
  const auto are_all = [&](size_t from, const auto& holds) {
    return std::ranges::all_of(rows, [&](const NumberRow& r) {
      return holds(r[from]) && holds(r[from + 1]) && holds(r[from + 2]);
    });
  };
  const auto is_byte = [](double v) { return IsWholeNumber(v) && v >= 0 && v <= 255; };
  const auto is_share = [](double v) { return v >= 0 && v <= 1; };
  // Segments may end at whole metres, but hardly 100 of them off in a building.
  const auto is_near = [](double v) { return v <= 100; };
  if (are_all(3, is_byte) && !(are_all(0, IsWholeNumber) && are_all(3, is_near))) return true;
  if (are_all(3, is_share) && !are_all(0, is_share)) return true;
  const auto length = [](const NumberRow& r) { return PlaceIn(r, 3).norm(); };
  const auto is_unit = [&](const NumberRow& r) { return std::abs(length(r) - 1) < 0.01; };
  return std::ranges::any_of(rows, is_unit) && std::ranges::all_of(rows, [&](const NumberRow& r) {
           return is_unit(r) || !(length(r) > 0);
         });
}

ExternalMap FromColumns(const std::string& path, const std::vector<NumberRow>& rows) {
  const size_t columns = rows.front().size();
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() == columns && columns >= 3) continue;
    throw DataError(fmt::format("{}: row {} of numbers: found {} columns, expected {}", path, i + 1,
                                rows[i].size(), columns >= 3 ? columns : 3));
  }
  ExternalMap map;
  const bool has_id = columns == 7 && std::all_of(rows.begin(), rows.end(), [](const NumberRow& r) {
                        return IsWholeNumber(r[0]);
                      });
  const bool are_segments = has_id || (columns == 6 && !IsPointWithMore(rows));
  map.format = are_segments ? "text with segments" : "text with points";
  for (const NumberRow& row : rows) {
    if (are_segments) {
      map.lines.push_back({PlaceIn(row, has_id ? 1 : 0), PlaceIn(row, has_id ? 4 : 3)});
    } else {
      AddPoint(PlaceIn(row, 0), &map);
    }
  }
  return map;
}

// The points of markers, as rostopic and ros2 topic echo print them: PL-VIO and PL-VINS publish
// their lines as LINE_LIST, two points a line.
ExternalMap FromMarker(const std::string& path, std::string_view bytes) {
  ExternalMap map;
  map.format = "text of a marker";
  std::vector<double> numbers;
  bool in_points = false;
  ForEachTextRow(bytes, [&](int, std::string_view text) {
    const auto fields = SplitRow(text);
    if (fields.empty()) return;
    // Fields of a message stand at its left edge; points farther in, or behind a dash of ROS 2's.
    if (text.front() != ' ' && text.front() != '-') in_points = fields.front() == "points:";
    if (!in_points || fields.size() < 2) return;
    if (fields.back().find("...") != std::string_view::npos) {
      throw DataError(path +
                      ": found '...' in place of points, expected all: ros2 topic echo "
                      "writes them with --full-length");
    }
    numbers.push_back(ParseNumber(fields.back()).value_or(NAN));  // .nan is YAML's
  });
  for (size_t i = 0; i + 6 <= numbers.size(); i += 6) {
    map.lines.push_back({PlaceIn(numbers, i), PlaceIn(numbers, i + 3)});
  }
  return map;
}

}  // namespace

void AddTrack(const std::string& path, ExternalMap* map) {
  bool is_first = true;
  ForEachTextRow(ReadFile(path), [&](int, std::string_view text) {
    if (!is_first) return;
    is_first = false;
    const std::vector<NumberRow> rows = ParseNumberRows(path, text);
    if (rows.size() != 1 || rows.front().size() != 6) {
      throw DataError(fmt::format(
          "{}: row 1: found '{}', expected the six numbers of a track of limap", path, text));
    }
    map->lines.push_back({PlaceIn(rows.front(), 0), PlaceIn(rows.front(), 3)});
  });
}

ExternalMap ReadMapText(const std::string& path, std::string_view bytes) {
  if (bytes.find("\npoints:") != std::string_view::npos) return FromMarker(path, bytes);
  const std::vector<NumberRow> rows = ParseNumberRows(path, bytes);
  if (rows.empty()) throw DataError(path + ": found no row of numbers, expected points or lines");
  if (IsLimapText(rows)) return FromLimap(path, rows);
  if (std::all_of(rows.begin(), rows.end(), IsLine3DRow)) return FromLine3D(rows);
  return FromColumns(path, rows);
}

}  // namespace slcmap::data
