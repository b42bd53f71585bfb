// Rows of numbers in text files: comma- or blank-separated, with stamps that keep their
// nanoseconds.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/file.h"

namespace slcmap {

// The fields of a row without blanks, quotes and a carriage return around them. Where a comma or a
// semicolon is in the row, only the one that comes first separates (so a field may be empty), else
// blanks do. Marks between quotes do not. A blank row and one that starts with '#' have no fields.
std::vector<std::string_view> SplitRow(std::string_view row);

// A decimal number, wholly read; nothing for other text. "nan" and "inf" are read as such.
std::optional<double> ParseNumber(std::string_view text);

// A decimal number times 10^shift as an integer, without passing through a double: "12.000000001"
// with shift 9 is 12000000001, and "1.4e18" with shift 0 is 1400000000000000000. Digits below one
// are rounded off. Nothing for other text and beyond the range of int64.
std::optional<int64_t> ParseScaledInteger(std::string_view text, int shift);

// True where a comma or a semicolon, not only blanks, separates two neighbouring fields that
// SplitRow gave of one row.
bool SeparatedByMark(std::string_view field, std::string_view next);

// Calls handle(row number from 1, fields) for each row of the file that has fields, without the
// byte order mark that some editors put before the first. Throws DataError, naming the file, when
// it cannot be read.
template <typename Handler>
void ForEachRow(const std::string& path, Handler handle) {
  const std::string text = WithoutByteOrderMark(ReadFile(path));
  int row = 0;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    const std::vector<std::string_view> fields =
        SplitRow(std::string_view(text).substr(from, end - from));
    ++row;
    if (!fields.empty()) handle(row, fields);
    from = end + 1;
  }
}

}  // namespace slcmap
