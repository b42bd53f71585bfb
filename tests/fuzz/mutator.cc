#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace slcmap::fuzz {
namespace {

constexpr size_t kMaxBytes = 1 << 16;

// What readers stumble over in the place of a number.
constexpr std::array<std::string_view, 24> kFields = {
    "0",          "-1",          "1e30",  "-1e308",
    "nan",        "inf",         "",      "2147483648",
    "4294967295", "-2147483649", "1e-30", "9223372036854775807",
    "1e400",      "0x10",        "1.5",   "18446744073709551616",
    "true",       "null",        "[]",    "{}",
    "\"",         "\xff\xfe",    "00",    "-"};

constexpr std::string_view kSeparators = " ,:\n[]{}\"";

// The first byte and the size of a piece at random.
std::pair<size_t, size_t> Piece(size_t size, size_t start, size_t length) {
  const size_t from = size == 0 ? 0 : start % size;
  return {from, std::min(size - from, length)};
}

std::vector<std::string> Rows(const std::string& text) {
  std::vector<std::string> rows(1);
  for (const char c : text) {
    rows.back() += c;
    if (c == '\n') rows.emplace_back();
  }
  return rows;
}

}  // namespace

std::string Mutator::Mutate(const std::string& input, const std::string& other) {
  std::string text = input;
  for (size_t changes = 1 + Below(4); changes > 0; --changes) {
    switch (Below(8)) {
      case 0:
      case 1:
        ChangeRows(&text);
        break;
      case 2:
        Splice(other, &text);
        break;
      case 3:
      case 4:
        ChangeBytes(&text);
        break;
      default:
        ChangeField(&text);
    }
  }
  text.resize(std::min(text.size(), kMaxBytes));
  return text;
}

void Mutator::ChangeBytes(std::string* text) {
  const auto [from, size] = Piece(text->size(), Below(kMaxBytes), 1 + Below(8));
  switch (Below(5)) {
    case 0:
      text->erase(from, size);
      break;
    case 1:
      text->insert(from, 1 + Below(8), static_cast<char>(Below(256)));
      break;
    case 2:
      text->resize(from);
      break;
    case 3:
      std::fill_n(text->begin() + from, size, static_cast<char>(Below(2) == 0 ? 0xff : 0));
      break;
    default:
      if (size > 0) (*text)[from] ^= static_cast<char>(1 << Below(8));
  }
}

void Mutator::ChangeRows(std::string* text) {
  std::vector<std::string> rows = Rows(*text);
  const size_t row = Below(rows.size()), other = Below(rows.size());
  switch (Below(3)) {
    case 0:
      rows.erase(rows.begin() + row);
      break;
    case 1:
      rows.insert(rows.begin() + other, std::string(rows[row]));
      break;
    default:
      std::swap(rows[row], rows[other]);
  }
  text->clear();
  for (const std::string& part : rows) *text += part;
}

void Mutator::ChangeField(std::string* text) {
  const size_t place = Below(text->size());
  const size_t before = text->find_last_of(kSeparators, place);
  const size_t from = before == std::string::npos ? 0 : before + 1;
  const size_t to = std::min(text->find_first_of(kSeparators, from), text->size());
  text->replace(from, to - from, kFields[Below(kFields.size())]);
}

void Mutator::Splice(const std::string& other, std::string* text) {
  const auto [from, size] = Piece(other.size(), Below(kMaxBytes), 1 + Below(256));
  text->insert(Below(text->size() + 1), other, from, size);
}

}  // namespace slcmap::fuzz
