#include "data/text_row.h"

#include <charconv>
#include <limits>

namespace slcmap {
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
    digits.resize(digits.size() - below_one);
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

}  // namespace slcmap
