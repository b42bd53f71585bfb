#include "data/io/pose_rows.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/core/error.h"
#include "data/io/csv.h"

namespace slcmap::inline data {
namespace {

using Fields = std::vector<std::string_view>;

constexpr double kMostNormError = 0.01;                          // of a quaternion as written
constexpr size_t kMatrixColumns = 12, kWholeMatrixColumns = 16;  // without its last row, with it
constexpr size_t kColmapColumns = 10;

// Where the columns are: x y z, then the quaternion's four.
struct Columns {
  size_t stamp = 0;
  std::array<size_t, 3> p = {1, 2, 3};
  std::array<size_t, 4> q = {4, 5, 6, 7};
  bool is_scalar_first = false;
  size_t Count() const {
    return 1 + std::max({stamp, *std::max_element(p.begin(), p.end()),
                         *std::max_element(q.begin(), q.end())});
  }
};

// "q_RS_w []" is "qrsw", of which the last letter and the first tell.
std::string Letters(std::string_view name) {
  std::string letters;
  for (const char c : name.substr(0, name.find_first_of("[("))) {
    if (std::isalpha(static_cast<unsigned char>(c))) letters += static_cast<char>(std::tolower(c));
  }
  return letters;
}

// A column's quantity and its axis: {'q', 'w'}, {'p', 'x'}, {'t', 0} for a stamp.
std::pair<char, char> FindColumn(std::string_view name) {
  std::string letters = Letters(name);
  for (const char* unit : {"stampns", "stampus", "stampms", "stamps"}) {
    if (letters.starts_with("t") && letters.find(unit) != std::string::npos) return {'t', 0};
  }
  if (letters == "t" || letters == "time" || letters.find("stamp") != std::string::npos ||
      letters.starts_with("secs") || letters.starts_with("timens")) {
    return {'t', 0};
  }
  if (letters.empty()) return {0, 0};
  // "x_m", "tx", "pos_x", "position.x", "qx", "orientation_w", "q_RS_w".
  if (letters.size() == 2 && letters[1] == 'm' && std::string("xyz").find(letters[0]) < 3) {
    letters.pop_back();
  }
  const char axis = letters.back();
  const bool is_quaternion = letters[0] == 'q' || letters.find("orient") != std::string::npos ||
                             letters.find("rot") != std::string::npos;
  if (is_quaternion && std::string("xyzw").find(axis) < 4) return {'q', axis};
  if (letters == "w") return {'q', 'w'};
  const bool is_position = letters.size() == 1 || letters[0] == 'p' ||
                           (letters.size() == 2 && letters[0] == 't') ||
                           letters.starts_with("trans") || letters.starts_with("txy");
  if (is_position && std::string("xyz").find(axis) < 3) return {'p', axis};
  return {0, 0};
}

// "x [m]" is one column.
Fields WithoutUnits(Fields names) {
  std::erase_if(
      names, [](std::string_view name) { return name.starts_with('[') || name.starts_with('('); });
  return names;
}

// Nothing where the names do not tell all of it.
std::optional<Columns> FindColumns(const Fields& names) {
  Columns columns;
  std::array<bool, 8> found = {};
  std::array<size_t, 4> of_axis = {};  // x y z w
  for (size_t i = 0; i < names.size(); ++i) {
    const auto [quantity, axis] = FindColumn(names[i]);
    const size_t number = std::string("xyzw").find(axis);
    if (quantity == 't' && !found[0]) {
      columns.stamp = i;
      found[0] = true;
    } else if (quantity == 'p' && !found[1 + number]) {
      columns.p[number] = i;
      found[1 + number] = true;
    } else if (quantity == 'q' && !found[4 + number]) {
      of_axis[number] = i;
      found[4 + number] = true;
    }
  }
  if (std::find(found.begin(), found.end(), false) != found.end()) return std::nullopt;
  columns.is_scalar_first = of_axis[3] < of_axis[0];
  columns.q = columns.is_scalar_first
                  ? std::array<size_t, 4>{of_axis[3], of_axis[0], of_axis[1], of_axis[2]}
                  : of_axis;
  return columns;
}

bool IsNumber(std::string_view text) { return ParseNumber(text).has_value(); }

double NumberIn(const Fields& fields, size_t column, const std::string& place) {
  const std::optional<double> value = ParseNumber(fields[column]);
  if (value && std::isfinite(*value)) return *value;
  if (fields[column].find(';') != std::string_view::npos) {
    throw DataError(fmt::format(
        "{}: found '{}' in column {}, expected a number with a decimal point: write decimal "
        "points, and commas or blanks between the columns (a spreadsheet does with the language "
        "English)",
        place, fields[column], column + 1));
  }
  throw DataError(fmt::format("{}: found '{}' in column {}, expected a finite number", place,
                              fields[column], column + 1));
}

RowText ParsePose(const Fields& fields, const Columns& columns, const std::string& place) {
  if (fields.size() < columns.Count()) {
    throw DataError(
        fmt::format("{}: found {} columns, expected {}: {}, or the 12 of a KITTI matrix", place,
                    fields.size(), columns.Count(),
                    columns.is_scalar_first ? "stamp_ns, x, y, z, qw, qx, qy, qz"
                                            : "stamp_s x y z qx qy qz qw"));
  }
  RowText row;
  row.stamp = fields[columns.stamp];
  if (!IsNumber(row.stamp)) {
    throw DataError(fmt::format("{}: found '{}', expected a stamp", place, row.stamp));
  }
  double norm2 = 0;
  for (size_t i = 0; i < 3; ++i) {
    row.pose.p[static_cast<Eigen::Index>(i)] = NumberIn(fields, columns.p[i], place);
  }
  for (size_t i = 0; i < 4; ++i) {
    row.pose.quaternion[i] = NumberIn(fields, columns.q[i], place);
    norm2 += row.pose.quaternion[i] * row.pose.quaternion[i];
  }
  if (!(std::abs(std::sqrt(norm2) - 1) <= kMostNormError)) {
    throw DataError(
        fmt::format("{}: found a quaternion of norm {:.4g}, expected 1", place, std::sqrt(norm2)));
  }
  return row;
}

// As some programs write where tracking was lost.
bool IsLost(const Fields& fields, size_t first, size_t count) {
  return std::any_of(
      fields.begin() + static_cast<std::ptrdiff_t>(std::min(first, fields.size())),
      fields.begin() + static_cast<std::ptrdiff_t>(std::min(first + count, fields.size())),
      [](std::string_view field) { return std::isnan(ParseNumber(field).value_or(0)); });
}

RowText ParseMatrix(const Fields& fields, size_t first, const std::string& place) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (size_t i = 0; i < kMatrixColumns; ++i) {
    matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
        NumberIn(fields, first + i, place);
  }
  const RigidTransform T = RigidTransformFromMatrix(matrix, place);
  const Eigen::Quaterniond& q = T.rotation;
  RowText row;
  if (first > 0) row.stamp = fields[0];
  row.pose = {0, T.translation, {q.x(), q.y(), q.z(), q.w()}};
  return row;
}

// "left/1403636579763555584.png" is 1403636579763555584.
std::string_view GetStem(std::string_view path) {
  const size_t slash = path.find_last_of('/');
  if (slash != std::string_view::npos) path.remove_prefix(slash + 1);
  return path.substr(0, path.find_last_of('.'));
}

// Of a matrix from column `first` on: the 12 of its rows but the last one, or all 16; else 0.
size_t MatrixColumns(const Fields& fields, size_t first) {
  if (fields.size() == first + kMatrixColumns) return kMatrixColumns;
  if (fields.size() != first + kWholeMatrixColumns) return 0;
  for (size_t i = 0; i < 4; ++i) {
    if (ParseNumber(fields[first + kMatrixColumns + i]) != (i == 3 ? 1.0 : 0.0)) return 0;
  }
  return kWholeMatrixColumns;
}

// COLMAP's images.txt: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a row of points each.
bool IsColmapImage(const Fields& fields) {
  return fields.size() == kColmapColumns && IsNumber(fields[kColmapColumns - 2]) &&
         !IsNumber(fields.back());
}

// By the first row with numbers, and the names above it.
Columns FindForm(const Fields& fields, const std::optional<Columns>& named, FileText* file) {
  const size_t bare = named ? 0 : MatrixColumns(fields, 0);
  const bool has_stamps = fields.size() > 1 && !SeparatedByMark(fields[0], fields[1]);
  file->matrix_columns = bare > 0 ? bare : named || !has_stamps ? 0 : MatrixColumns(fields, 1);
  file->table.is_matrix = file->matrix_columns > 0;
  file->has_stamps = bare == 0;
  if (file->table.is_matrix) return {};
  if (!named && IsColmapImage(fields)) {
    file->is_colmap = true;
    file->table.is_scalar_first = true;
    return {kColmapColumns - 1, {5, 6, 7}, {1, 2, 3, 4}, true};
  }
  const bool is_euroc = fields.size() > 1 && fields[0].find('.') == std::string_view::npos &&
                        SeparatedByMark(fields[0], fields[1]);
  Columns columns;
  columns.is_scalar_first = is_euroc;
  if (named) columns = *named;
  if (is_euroc) file->form_shift = 0;
  file->table.is_scalar_first = columns.is_scalar_first;
  return columns;
}

// The names of a comment's columns, where it holds any: of the text of a file before its rows.
std::optional<Columns> NamesInComments(const std::string& text) {
  std::optional<Columns> columns;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    std::string_view line = std::string_view(text).substr(from, end - from);
    from = end + 1;
    if (line.empty() || line == "\r") continue;
    if (line[0] != '#') break;
    line.remove_prefix(std::min(line.find_first_not_of("# "), line.size()));
    if (const auto found = FindColumns(WithoutUnits(SplitRow(line)))) columns = found;
  }
  return columns;
}

}  // namespace

FileText ReadPoseRows(const std::string& path) {
  FileText file;
  file.table.path = path;
  std::optional<Columns> named = NamesInComments(std::string(WithoutByteOrderMark(ReadFile(path))));
  std::optional<Columns> columns;
  int lost = 0, first_lost = 0;
  ForEachRow(path, [&](int row, const Fields& fields) {
    const std::string place = fmt::format("{}: row {}", path, row);
    if (!columns && !IsNumber(fields[0])) {
      const std::optional<Columns> header = FindColumns(WithoutUnits(fields));
      if (!header) {
        throw DataError(fmt::format(
            "{}: found '{}', expected a stamp, or the names of columns (stamp x y z qx qy qz qw)",
            place, fields[0]));
      }
      if (named) return;
      spdlog::warn("{}: the columns are taken by the names of its header", place);
      named = header;
      return;
    }
    if (!columns) columns = FindForm(fields, named, &file);
    if (file.is_colmap && !IsColmapImage(fields)) return;  // its points
    if (IsLost(fields, file.has_stamps && !file.is_colmap ? 1 : 0,
               file.table.is_matrix ? kMatrixColumns : columns->Count() - 1)) {
      if (lost++ == 0) first_lost = row;
      if (!file.has_stamps || (columns->stamp < fields.size() &&
                               std::isfinite(ParseNumber(fields[columns->stamp]).value_or(NAN)))) {
        file.rows.push_back(
            {row, std::string(fields[file.has_stamps ? columns->stamp : 0]), {}, true});
      }
      return;
    }
    if (file.table.is_matrix) {
      const size_t count = file.matrix_columns + (file.has_stamps ? 1 : 0);
      if (fields.size() != count) {
        throw DataError(fmt::format("{}: found {} columns, expected {} as in the rows before",
                                    place, fields.size(), count));
      }
      file.rows.push_back(ParseMatrix(fields, count - file.matrix_columns, place));
    } else {
      Fields texts = fields;
      if (file.is_colmap) texts.back() = GetStem(texts.back());
      file.rows.push_back(ParsePose(texts, *columns, place));
    }
    file.rows.back().row = row;
  });
  if (lost > 0) {
    spdlog::warn("{}: {} rows hold no numbers (NaN), first row {}, and are left out", path, lost,
                 first_lost);
  }
  if (file.is_colmap) {
    spdlog::warn(
        "{}: rows are those of COLMAP's images.txt: its images' names are taken to be their stamps",
        path);
  }
  if (std::ranges::all_of(file.rows, &RowText::is_lost))
    throw DataError(path + ": found no pose, expected at least one row");
  return file;
}

}  // namespace slcmap::data
