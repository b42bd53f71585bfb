#include "data/io/csv.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string_view Trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// The first of the marks outside quotes; npos where there is none.
size_t FindMark(std::string_view row, std::string_view marks) {
  bool quoted = false;
  for (size_t i = 0; i < row.size(); ++i) {
    if (row[i] == '"') quoted = !quoted;
    if (!quoted && marks.find(row[i]) != std::string_view::npos) return i;
  }
  return std::string_view::npos;
}

// What is between quotes, as spreadsheets and scripts write texts.
std::string_view Unquoted(std::string_view field) {
  field = Trim(field);
  const bool quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return quoted ? Trim(field.substr(1, field.size() - 2)) : field;
}

std::vector<std::string_view> SplitAt(std::string_view mark, std::string_view row) {
  std::vector<std::string_view> fields;
  size_t end = 0;
  while ((end = FindMark(row, mark)) != std::string_view::npos) {
    fields.push_back(Unquoted(row.substr(0, end)));
    row.remove_prefix(end + 1);
  }
  row = Unquoted(row);
  if (!row.empty()) fields.push_back(row);  // a mark at the end opens no field
  return fields;
}

std::vector<std::string_view> SplitAtBlanks(std::string_view row) {
  std::vector<std::string_view> fields;
  while (!row.empty()) {
    const size_t end = std::min(row.find_first_of(kBlanks), row.size());
    fields.push_back(row.substr(0, end));
    row = Trim(row.substr(end));
  }
  return fields;
}

// The digits of a decimal number, its sign, and the power of ten of its last digit.
struct Decimal {
  std::string digits;
  bool negative = false;
  int exponent = 0;
};

std::optional<Decimal> ParseDecimal(std::string_view text) {
  Decimal decimal;
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) {
    decimal.negative = text[0] == '-';
    text.remove_prefix(1);
  }
  bool after_point = false;
  size_t i = 0;
  for (; i < text.size() && text[i] != 'e' && text[i] != 'E'; ++i) {
    if (text[i] == '.' && !after_point) {
      after_point = true;
    } else if (text[i] >= '0' && text[i] <= '9') {
      decimal.digits += text[i];
      decimal.exponent -= after_point;
    } else {
      return std::nullopt;
    }
  }
  if (decimal.digits.empty()) return std::nullopt;
  if (i == text.size()) return decimal;
  std::string_view power = text.substr(i + 1);
  if (power.size() > 1 && power[0] == '+') power.remove_prefix(1);
  int value = 0;
  const auto [end, error] = std::from_chars(power.data(), power.data() + power.size(), value);
  if (error != std::errc() || end != power.data() + power.size() || std::abs(value) > 400) {
    return std::nullopt;
  }
  decimal.exponent += value;
  return decimal;
}

}  // namespace

std::vector<std::string_view> SplitRow(std::string_view row) {
  row = Trim(row);
  if (row.empty() || row[0] == '#') return {};
  const size_t mark = FindMark(row, ",;");
  return mark == std::string_view::npos ? SplitAtBlanks(row) : SplitAt(row.substr(mark, 1), row);
}

bool SeparatedByMark(std::string_view field, std::string_view next) {
  if (field.empty() || next.empty()) return true;  // blanks enclose no empty field
  const std::string_view between(field.data() + field.size(),
                                 static_cast<size_t>(next.data() - field.data()) - field.size());
  return between.find_first_of(",;") != std::string_view::npos;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  for (size_t from = 0, to = 0; to != std::string::npos; from = to + 1) {
    to = text.find(',', from);
    parts.push_back(text.substr(from, to == std::string::npos ? to : to - from));
  }
  return parts;
}

std::optional<double> ParseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<int64_t> ParseScaledInteger(std::string_view text, int shift) {
  std::optional<Decimal> decimal = ParseDecimal(text);
  if (!decimal) return std::nullopt;
  std::string& digits = decimal->digits;
  const int zeros = decimal->exponent + shift;
  bool round_up = false;
  if (zeros >= 0) {
    digits.append(zeros, '0');
  } else if (const size_t below_one = -zeros; below_one <= digits.size()) {
    round_up = digits[digits.size() - below_one] >= '5';
    digits.erase(digits.size() - below_one);
  } else {
    digits.clear();
  }
  int64_t value = 0;
  if (!digits.empty()) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || value == std::numeric_limits<int64_t>::max()) return std::nullopt;
  }
  value += round_up;
  return decimal->negative ? -value : value;
}

std::string CsvHeader(const CsvColumns& columns) {
  std::string header;
  for (const CsvColumn& column : columns) {
    if (!header.empty()) header += ',';
    header += column.name;
  }
  return header;
}

CsvTable CsvTable::Read(const std::string& path, const CsvColumns& columns) {
  CsvTable table = Read(path, CsvHeader(columns));
  for (std::size_t row = 0; row < table.rows(); ++row) table.CheckRow(row, columns);
  return table;
}

std::map<std::string, CsvTable> CsvTable::ReadTagged(
    const std::string& path, const std::map<std::string, CsvColumns>& columns, int64_t* cut_rows) {
  std::map<std::string, CsvTable> tables;
  for (const auto& [tag, named] : columns) {
    CsvTable& table = tables[tag];
    table.path_ = path;
    for (const CsvColumn& column : named) table.columns_.emplace_back(column.name);
  }
  std::string text = ReadFile(path);
  const std::size_t whole = text.rfind('\n') + 1;  // 0 where there is none
  *cut_rows += whole < text.size();
  std::istringstream rows(text.substr(0, whole));
  int line = 0;
  for (std::string row; std::getline(rows, row);) {
    const std::vector<std::string_view> fields = SplitRow((++line, row));
    if (fields.empty()) continue;
    const auto table = tables.find(std::string(fields[0]));
    if (table == tables.end()) {
      throw DataError(fmt::format("{}: row {}: found '{}', expected the name of a table", path,
                                  line, fields[0]));
    }
    table->second.AddRow({fields.begin() + 1, fields.end()}, line);
    table->second.CheckRow(table->second.rows() - 1, columns.at(table->first));
  }
  return tables;
}

void CsvTable::CheckRow(std::size_t row, const CsvColumns& columns) const {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const CsvColumn& column = columns[i];
    std::optional<double> value;
    if (column.kind == CsvColumn::Kind::kInteger) {
      value = static_cast<double>(Integer(row, i));
    } else if (column.kind == CsvColumn::Kind::kNumber) {
      value = Number(row, i);
    } else {
      value = OptionalNumber(row, i);
    }
    if (!value || (*value >= column.least && *value <= column.most)) continue;
    Fail(row, i, fmt::format("{} to {}", column.least, column.most));
  }
}

void CsvTable::ForEach(const std::string& path, const CsvColumns& columns,
                       const std::function<void(const CsvTable&)>& visit) {
  ReadRows(path, CsvHeader(columns), [&](CsvTable* table) {
    table->CheckRow(0, columns);
    visit(*table);
    table->rows_.clear();
  });
}

CsvTable CsvTable::Read(const std::string& path, const std::string& header) {
  return ReadRows(path, header, [](CsvTable*) {});
}

CsvTable CsvTable::ReadRows(const std::string& path, const std::string& header,
                            const std::function<void(CsvTable*)>& handle) {
  CsvTable table;
  table.path_ = path;
  ForEachRow(path, [&](int line, const std::vector<std::string_view>& fields) {
    const std::vector<std::string> cells(fields.begin(), fields.end());
    if (!table.columns_.empty()) {
      table.AddRow(cells, line);
      handle(&table);
    } else if (const std::string found = fmt::format("{}", fmt::join(cells, ","));
               found != header) {
      throw DataError(fmt::format("{}: row {}: found the columns '{}', expected '{}'", path, line,
                                  found, header));
    } else {
      table.columns_ = cells;
    }
  });
  if (table.columns_.empty()) {
    throw DataError(fmt::format("{}: empty, expected the columns '{}'", path, header));
  }
  return table;
}

void CsvTable::AddRow(const std::vector<std::string>& cells, int line) {
  if (cells.size() != columns_.size()) {
    throw DataError(fmt::format("{}: row {}: found {} columns, expected {}", path_, line,
                                cells.size(), columns_.size()));
  }
  rows_.push_back({line, cells});
}

void CsvTable::Fail(std::size_t row, std::size_t column, const std::string& expected) const {
  throw DataError(fmt::format("{}: row {}: {}: found '{}', expected {}", path_, rows_[row].line,
                              columns_[column], rows_[row].cells[column], expected));
}

int CsvTable::Int(std::size_t row, std::size_t column) const {
  return static_cast<int>(Integer(row, column));
}

int64_t CsvTable::Integer(std::size_t row, std::size_t column) const {
  const std::optional<int64_t> value = ParseScaledInteger(rows_[row].cells[column], 0);
  if (!value) Fail(row, column, "an integer");
  return *value;
}

double CsvTable::Number(std::size_t row, std::size_t column) const {
  const std::optional<double> value = ParseNumber(rows_[row].cells[column]);
  if (!value || !std::isfinite(*value)) Fail(row, column, "a finite number");
  return *value;
}

std::optional<double> CsvTable::OptionalNumber(std::size_t row, std::size_t column) const {
  if (rows_[row].cells[column] == "nan") return std::nullopt;
  return Number(row, column);
}

namespace {

constexpr int kFewRows = 4;  // of which nothing is told

bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// A comma or semicolon between digits: the table's columns are separated by another mark.
bool HasDecimalComma(std::string_view field) {
  for (size_t i = 1; i + 1 < field.size(); ++i) {
    const bool mark = field[i] == ',' || field[i] == ';';
    if (mark && IsDigit(field[i - 1]) && (IsDigit(field[i + 1]) || field[i + 1] == '-')) {
      return true;
    }
  }
  return false;
}

// Twice as many columns as there should be numbers, none with a point: all were cut at their
// commas.
bool IsCutAtCommas(const std::vector<std::string_view>& fields) {
  constexpr size_t kCut = 1 + 2 * 6;  // of an IMU's row
  const auto has_point = [](std::string_view field) { return field.find('.') != field.npos; };
  return fields.size() == kCut && std::none_of(fields.begin(), fields.end(), has_point);
}

// An IMU's readings as whole numbers of many digits.
bool HasLostPoints(const std::vector<std::string_view>& fields) {
  constexpr size_t kReadings = 6, kManyDigits = 7, kMany = 3;
  if (fields.size() < 1 + kReadings) return false;
  const auto begin = fields.begin() + 1, end = begin + kReadings;
  const auto is_whole = [](std::string_view field) {
    return field.find_first_not_of("+-0123456789") == field.npos;
  };
  const auto is_long = [](std::string_view field) { return field.size() >= kManyDigits; };
  return std::all_of(begin, end, is_whole) &&
         std::count_if(begin, end, is_long) >= std::ptrdiff_t{kMany};
}

std::string Example(const std::vector<std::string_view>& fields) {
  constexpr size_t kLongest = 60;
  std::string text;
  for (const std::string_view field : fields) {
    if (!text.empty()) text += " | ";
    text += field;
  }
  for (char& c : text) {
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  }
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

// The value of a number's last digit where it is written as a power of ten; 0 of other text.
double LastDigit(std::string_view text) {
  const size_t power = text.find_first_of("eE");
  if (power == std::string_view::npos) return 0;
  const std::string_view mantissa = text.substr(0, power);
  const size_t point = mantissa.find('.');
  const auto decimals = point == std::string_view::npos ? 0 : mantissa.size() - point - 1;
  return std::pow(
      10, std::atof(std::string(text.substr(power + 1)).c_str()) - static_cast<double>(decimals));
}

}  // namespace

void TableText::AddRead(const std::vector<std::string_view>& fields) {
  ++read_;
  if (IsCutAtCommas(fields) && decimal_commas_++ == 0) first_decimal_comma_ = Example(fields);
  if (HasLostPoints(fields) && pointless_++ == 0) first_pointless_ = Example(fields);
  const double resolution_ns = LastDigit(fields[0]);
  if (resolution_ns == 0 || (resolution_ns_ > 0 && resolution_ns >= resolution_ns_)) return;
  resolution_ns_ = resolution_ns;
  stamp_ = fields[0];
}

void TableText::AddUnreadable(int row, const std::vector<std::string_view>& fields) {
  if (unreadable_++ == 0) first_unreadable_ = fmt::format("row {}: '{}'", row, Example(fields));
  const bool commas = std::any_of(fields.begin(), fields.end(), HasDecimalComma);
  if (commas && decimal_commas_++ == 0) first_decimal_comma_ = Example(fields);
}

void TableText::RequireReadable() const {
  const int64_t rows = read_ + unreadable_;
  if (rows < kFewRows) return;
  if (2 * decimal_commas_ > rows) {
    throw InputFault(
        "decimal-commas",
        fmt::format("{}: found numbers with decimal commas ('{}'), expected {} with points", path_,
                    first_decimal_comma_, columns_),
        fmt::format(
            "write {} with decimal points and commas between the columns (a spreadsheet does "
            "with the language English), stamps with all their digits",
            path_));
  }
  if (2 * pointless_ > rows) {
    throw InputFault(
        "decimal-points",
        fmt::format("{}: found numbers that have lost their decimal points ('{}'), expected {} in "
                    "rad/s and m/s^2",
                    path_, first_pointless_, columns_),
        fmt::format("write {} anew with decimal points (a spreadsheet reads them with the language "
                    "English)",
                    path_));
  }
  if (2 * unreadable_ <= rows) return;
  throw InputFault(
      "rows",
      fmt::format("{}: found {} of {} rows that cannot be read, the first {}, expected "
                  "{}",
                  path_, unreadable_, rows, first_unreadable_, columns_),
      fmt::format("write the rows of {} as {}", path_, columns_));
}

void TableText::WarnOfDigits(Warnings* warnings) const {
  constexpr double kFine_ns = 1e3;
  if (resolution_ns_ <= kFine_ns) return;
  warnings->Add(kStampDigits, fmt::format("{}: '{}', steps of {:.0f} us, which is of use", path_,
                                          stamp_, 1e-3 * resolution_ns_));
}

void TableText::RequireDigits() const {
  constexpr double kMaxResolution_ns = 1e6;
  if (resolution_ns_ <= kMaxResolution_ns) return;
  throw InputFault(
      "stamp-digits",
      fmt::format(
          "{}: found stamps that have lost digits ('{}': steps of {:.3g} s), expected whole "
          "nanoseconds",
          path_, stamp_, 1e-9 * resolution_ns_),
      fmt::format(
          "write the first column of {} with all its digits, as whole numbers: import it as "
          "text into a spreadsheet, or print integers, not doubles",
          path_));
}

void TableText::RequireStamps(size_t rows, size_t kept) const {
  if (rows < kFewRows || 2 * kept >= rows) return;
  throw InputFault(
      "stamp-digits",
      fmt::format("{}: found {} rows with only {} different stamps, expected each to have its own",
                  path_, rows, kept),
      fmt::format(
          "stamps seem to have lost digits{}: write the first column of {} as whole "
          "nanoseconds with all digits (a spreadsheet keeps 15, a float 7, and C++ prints 6)",
          kept > 1 ? "" : ", or the driver did not set them", path_));
}

}  // namespace slcmap::data
