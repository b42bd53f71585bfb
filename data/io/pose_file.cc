#include "data/io/pose_file.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/csv.h"

namespace slcmap::inline data {
namespace {

using Fields = std::vector<std::string_view>;

constexpr double kMostNormError = 0.01;                          // of a quaternion as written
constexpr int64_t kMostPoseStamp_ns = int64_t{1} << 62;          // differences stay within range
constexpr size_t kMatrixColumns = 12, kWholeMatrixColumns = 16;  // without its last row, with it
constexpr size_t kColmapColumns = 10;

struct StampUnit {
  const char* name;
  int shift;  // power of ten to nanoseconds
};
constexpr std::array<StampUnit, 4> kUnits = {{{"s", 9}, {"ms", 6}, {"us", 3}, {"ns", 0}}};

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

struct RowText {
  int row = 0;
  std::string stamp;
  PoseRow pose;
  bool is_lost = false;  // without numbers: it counts as a row, and is no pose
};

double NumberIn(const Fields& fields, size_t column, const std::string& place) {
  const std::optional<double> value = ParseNumber(fields[column]);
  if (value && std::isfinite(*value)) return *value;
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

struct FileText {
  std::vector<RowText> rows;
  bool has_stamps = true;
  bool is_colmap = false;
  size_t matrix_columns = 0;
  int form_shift = 9;  // of the stamps, as the form of the file has them
  PoseTable table;
};

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

int64_t StampIn(const std::string& path, const RowText& row, int shift) {
  const std::optional<int64_t> stamp_ns = ParseScaledInteger(row.stamp, shift);
  if (stamp_ns && std::abs(*stamp_ns) <= kMostPoseStamp_ns) return *stamp_ns;
  throw DataError(
      fmt::format("{}: row {}: found '{}', expected a stamp", path, row.row, row.stamp));
}

// What tells the unit of stamps.
struct StampFigures {
  double least = INFINITY, most = -INFINITY, step = 0;  // 0 where all are alike
};

StampFigures SelectFigures(const FileText& file) {
  StampFigures figures;
  std::vector<double> steps;
  double before = 0;
  for (const RowText& row : file.rows) {
    const double stamp = ParseNumber(row.stamp).value_or(0);
    if (&row != &file.rows[0] && stamp != before) steps.push_back(std::abs(stamp - before));
    figures.least = std::min(figures.least, stamp);
    figures.most = std::max(figures.most, stamp);
    before = stamp;
  }
  figures.step = Quantile(steps, 0.5);
  return figures;
}

// How well stamps are explained by a unit, or by being numbers of images.
struct UnitFit {
  const StampUnit* unit = nullptr;  // none for numbers of images
  int rank = -1;                    // higher by a rate of poses, by times of the clock, by dates
  double share = 0;                 // of the time of stamps and clock, what both have
};

// Where the stamps do not lie on the clock's times they may have another start.
UnitFit ComputeFit(const StampUnit& unit, const StampFigures& stamps, double offset_s,
                   const Clock& clock) {
  constexpr double kLeastStep_s = 4e-4, kMostStep_s = 20, kDate_s = 1e9;
  const double scale = std::pow(10, unit.shift - 9), step_s = scale * stamps.step;
  const double size_s = scale * std::max(std::abs(stamps.least), std::abs(stamps.most));
  if (size_s > 1e-9 * static_cast<double>(kMostPoseStamp_ns)) return {};
  const bool is_rate = step_s == 0 || (kLeastStep_s <= step_s && step_s <= kMostStep_s);
  UnitFit fit{&unit, (is_rate ? 3 : 0) + (size_s >= kDate_s ? 2 : 0), 1};
  const double from_s = scale * stamps.least + offset_s, to_s = scale * stamps.most + offset_s;
  if (clock.empty()) return fit;
  const double start_s = ToSeconds(clock.front()), end_s = ToSeconds(clock.back());
  const bool is_on = from_s <= end_s && start_s <= to_s;
  if (is_on) fit.rank += 2;
  const double shift_s = is_on ? 0 : start_s - from_s;
  const double shared_s = std::min(to_s + shift_s, end_s) - std::max(from_s + shift_s, start_s);
  const double all_s = std::max(to_s + shift_s, end_s) - std::min(from_s + shift_s, start_s);
  if (all_s > 0) fit.share = shared_s / all_s;
  return fit;
}

// Whole numbers from 0 or 1 on, most of them by one each, that in seconds would be far more than
// the clock has: the share of them that it has.
double ShareOfNumbers(const FileText& file, const StampFigures& stamps, const Clock& clock) {
  if (clock.size() < 2 || stamps.least > 1 || stamps.step != 1 ||
      stamps.most <= 1.5 * ToSeconds(clock.back() - clock.front()) + 1) {
    return 0;
  }
  double before = -1;
  for (const RowText& row : file.rows) {
    const double number = ParseNumber(row.stamp).value_or(-1);
    if (number <= before || row.stamp.find_first_of(".eE") != std::string::npos) return 0;
    before = number;
  }
  return std::min(1.0, static_cast<double>(clock.size()) / stamps.most);
}

// The unit of the stamps; none where they are numbers of images. Throws DataError where two fit.
const StampUnit* FindUnit(const FileText& file, const PoseForm& form, const Clock& clock) {
  const StampFigures stamps = SelectFigures(file);
  std::vector<UnitFit> fits;
  for (const StampUnit& unit : kUnits) {
    if (form.stamps == unit.name) return &unit;
    fits.push_back(ComputeFit(unit, stamps, form.offset_s, clock));
  }
  const auto is_better = [](const UnitFit& a, const UnitFit& b) {
    return std::pair(a.rank, a.share) > std::pair(b.rank, b.share);
  };
  std::ranges::stable_sort(fits, is_better);
  if (fits[0].rank < 0) return &kUnits.back();  // too large for any
  const double numbers = ShareOfNumbers(file, stamps, clock);
  if (numbers > 0) fits.push_back({nullptr, fits[0].rank, numbers});
  std::ranges::stable_sort(fits, is_better);
  const UnitFit &best = fits[0], &second = fits[1];
  if (second.rank == best.rank && best.share < 0.5 && 2 * second.share > best.share) {
    const auto name = [](const UnitFit& fit) {
      return fit.unit == nullptr ? "numbers of images" : fit.unit->name;
    };
    throw DataError(fmt::format(
        "{}: found stamps from {} to {}, which may be {} or {}, expected times that fit the "
        "recording in one unit; give --poses-stamps with ns, us, ms or s",
        file.table.path, file.rows.front().stamp, file.rows.back().stamp, name(best),
        name(second)));
  }
  return best.unit;
}

void SetStampsIn(const StampUnit& unit, const PoseForm& form, FileText* file) {
  const bool is_usual = unit.shift == file->form_shift || form.stamps == unit.name ||
                        (unit.shift == 0 && file->form_shift == 9 &&
                         file->rows[0].stamp.find('.') == std::string::npos);
  if (!is_usual) {
    spdlog::warn("{}: stamps are taken to be in {}, by their size, as {} (--poses-stamps says it)",
                 file->table.path, unit.name, file->rows[0].stamp);
  }
  for (RowText& row : file->rows) row.pose.stamp_ns = StampIn(file->table.path, row, unit.shift);
}

// A column of another file, in any unit.
std::vector<int64_t> StampsFrom(const PoseForm& form, const Clock& clock) {
  const std::string& path = form.stamps;
  FileText file;
  file.table.path = path;
  ForEachRow(path, [&](int row, const Fields& fields) {
    if (file.rows.empty() && !IsNumber(fields[0])) return;
    file.rows.push_back({row, std::string(fields[0]), {}});
  });
  if (file.rows.empty()) throw DataError(path + ": found no stamp, expected one in each row");
  const StampUnit* unit = FindUnit(file, form, clock);
  if (unit == nullptr) {
    throw DataError(path + ": found numbers of rows, expected the stamp of each row");
  }
  SetStampsIn(*unit, form, &file);
  std::vector<int64_t> stamps_ns;
  for (const RowText& row : file.rows) stamps_ns.push_back(row.pose.stamp_ns);
  return stamps_ns;
}

bool NamesUnit(const std::string& stamps) {
  return stamps.empty() || std::any_of(kUnits.begin(), kUnits.end(),
                                       [&](const StampUnit& unit) { return stamps == unit.name; });
}

void SetStampsOfOthers(const std::string& of, const std::vector<int64_t>& stamps_ns,
                       FileText* file) {
  if (stamps_ns.size() != file->rows.size()) {
    throw DataError(fmt::format(
        "{}: found {} rows {} and {} stamps in {}, expected as many; give --poses-stamps FILE, "
        "with the stamp of each row in FILE (KITTI's times.txt)",
        file->table.path, file->rows.size(),
        file->has_stamps ? "of poses" : "of matrices without stamps (KITTI's form)",
        stamps_ns.size(), of));
  }
  for (size_t i = 0; i < stamps_ns.size(); ++i) file->rows[i].pose.stamp_ns = stamps_ns[i];
}

// A truth has rows at other times than images, unless it has as many.
void SetStampsOfImages(const Clock& clock, bool is_of_images, FileText* file) {
  const auto number = [](const RowText& row) { return *ParseScaledInteger(row.stamp, 0); };
  const auto count = static_cast<int64_t>(clock.size());
  const int64_t last = number(file->rows.back());
  const int64_t from = last == count && number(file->rows.front()) == 1 ? 1 : 0;
  if (last - from >= count || (!is_of_images && last - from + 1 < count)) {
    throw DataError(fmt::format(
        "{}: found stamps from {} to {} one by one, which are numbers of rows and no times, and {} "
        "stamps of {}; give --poses-stamps FILE, with the stamp of each row in FILE, or s where "
        "they are seconds",
        file->table.path, file->rows.front().stamp, last, count,
        is_of_images ? "images" : "the truth, which need not be those of the images"));
  }
  spdlog::warn(
      "{}: stamps from {} to {} one by one are taken to be the numbers of the {} stamps of images "
      "or truth (--poses-stamps s takes them as seconds)",
      file->table.path, file->rows.front().stamp, last, count);
  for (RowText& row : file->rows)
    row.pose.stamp_ns = clock[static_cast<size_t>(number(row) - from)];
}

void SetStamps(const PoseForm& form, const Clock& clock, bool is_of_images, FileText* file) {
  if (!NamesUnit(form.stamps)) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(form.stamps, error)) {
      throw ConfigError(fmt::format(
          "--poses-stamps: found '{}', expected ns, us, ms, s, or a file with a stamp in each row",
          form.stamps));
    }
    return SetStampsOfOthers(form.stamps, StampsFrom(form, clock), file);
  }
  if (!file->has_stamps) {
    SetStampsOfOthers("the recording's images or the truth", clock, file);
    spdlog::warn(
        "{}: rows of matrices without stamps (KITTI's form) are taken to be those of the {} stamps "
        "of images or truth, one after the other",
        file->table.path, clock.size());
    return;
  }
  const StampUnit* unit = FindUnit(*file, form, clock);
  if (unit == nullptr) return SetStampsOfImages(clock, is_of_images, file);
  SetStampsIn(*unit, form, file);
}

bool IsSamePose(const PoseRow& a, const PoseRow& b) {
  constexpr double kSame = 1e-6;
  return (a.p - b.p).norm() < kSame;
}

void RefuseLostDigits(const PoseTable& table, size_t repeated) {
  if (2 * repeated < table.rows.size() + repeated) return;
  throw DataError(fmt::format(
      "{}: found {} stamps of {} that are those of another row, expected one a row: the stamps "
      "lost digits; write them with all of them, as '%.9f'",
      table.path, repeated, table.rows.size() + repeated));
}

void Sort(PoseTable* table) {
  const auto is_before = [](const PoseRow& a, const PoseRow& b) { return a.stamp_ns < b.stamp_ns; };
  std::vector<PoseRow>& rows = table->rows;
  size_t unsorted = 0, repeated = 0, different = 0;
  for (size_t i = 1; i < rows.size(); ++i) unsorted += is_before(rows[i], rows[i - 1]);
  std::stable_sort(rows.begin(), rows.end(), is_before);
  std::vector<PoseRow> kept;
  for (const PoseRow& row : rows) {
    if (!kept.empty() && kept.back().stamp_ns == row.stamp_ns) {
      ++repeated;
      different += !IsSamePose(kept.back(), row);
      continue;
    }
    kept.push_back(row);
  }
  rows = std::move(kept);
  RefuseLostDigits(*table, repeated);
  if (unsorted > 0) {
    spdlog::warn("{}: found rows out of order at {} places; they are sorted by their stamps",
                 table->path, unsorted);
  }
  if (repeated > 0) {
    spdlog::warn(
        "{}: found {} rows with the stamp of another ({} of them with another pose); the "
        "first of each is taken",
        table->path, repeated, different);
  }
}

Eigen::Quaterniond MakeRotation(const PoseRow& row, bool is_scalar_first, bool is_conjugated) {
  const auto& v = row.quaternion;
  const Eigen::Quaterniond q = is_scalar_first ? Eigen::Quaterniond(v[0], v[1], v[2], v[3])
                                               : Eigen::Quaterniond(v[3], v[0], v[1], v[2]);
  return is_conjugated ? q.normalized().conjugate() : q.normalized();
}

}  // namespace

PoseTable ReadPoseTable(const std::string& path, const PoseForm& form, const Clock& clock,
                        bool is_of_images) {
  form.Check();
  FileText file = ReadPoseRows(path);
  SetStamps(form, clock, is_of_images, &file);
  for (const RowText& row : file.rows) {
    if (!row.is_lost) file.table.rows.push_back(row.pose);
  }
  Sort(&file.table);
  return file.table;
}

Trajectory CollectPoses(const PoseTable& table, const PoseForm& form,
                        const std::optional<RigidTransform>& T_imu_camera) {
  if (form.IsOfCamera() && !T_imu_camera) {
    throw ConfigError(
        "--poses-of camera: found no calibration, expected one that says where the camera is on "
        "the IMU: --calibration names it");
  }
  const bool is_scalar_first =
      form.quaternion.empty() ? table.is_scalar_first : form.quaternion.starts_with("wxyz");
  const RigidTransform turn{TurnUp(form.Up()), Eigen::Vector3d::Zero()};
  const int64_t offset_ns = std::llround(form.offset_s * 1e9);
  Trajectory trajectory;
  for (const PoseRow& row : table.rows) {
    RigidTransform T{MakeRotation(row, is_scalar_first && !table.is_matrix, form.IsConjugated()),
                     form.scale * row.p};
    if (form.IsInverse()) T = T.Inverse();
    if (form.IsOfCamera()) T = T * T_imu_camera->Inverse();
    trajectory.push_back({row.stamp_ns + offset_ns, turn * T});
  }
  return trajectory;
}

Eigen::Quaterniond TurnUp(const Eigen::Vector3d& up) {
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
}

Eigen::Vector3d MoveNearOrigin(Trajectory* trajectory) {
  constexpr double kFar_m = 1e4;
  if (trajectory->empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d& first = trajectory->front().T_world_imu.translation;
  if (first.norm() < kFar_m) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d offset_m = first.array().round();
  for (StampedPose& pose : *trajectory) pose.T_world_imu.translation -= offset_m;
  return offset_m;
}

}  // namespace slcmap::inline data
