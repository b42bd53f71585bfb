#include "data/table_text.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "data/input_fault.h"

namespace slcmap {
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
          "stamps seem to have lost digits: write the first column of {} as whole "
          "nanoseconds with all digits (a spreadsheet keeps 15, a float 7, and C++ prints 6)",
          path_));
}

}  // namespace slcmap
