// Rows of numbers in text files: comma- or blank-separated, with stamps that keep their
// nanoseconds; and tables with a header row, as the run folder holds them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/core/error.h"
#include "data/io/file.h"

namespace slcmap::inline data {

// The fields of a row without blanks, quotes and a carriage return around them. Where a comma or a
// semicolon is in the row, only the one that comes first separates (so a field may be empty), else
// blanks do. Marks between quotes do not. A blank row and one that starts with '#' have no fields.
std::vector<std::string_view> SplitRow(std::string_view row);

// The texts between the commas of an option, as they are: one more than there are commas.
std::vector<std::string> SplitAtCommas(const std::string& text);

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

// What the cells of a column may hold: a number from `least` to `most`, perhaps an integer, perhaps
// "nan" where there is none.
struct CsvColumn {
  enum class Kind { kInteger, kNumber, kOptionalNumber };
  const char* name;
  Kind kind;
  double least;
  double most;
};
using CsvColumns = std::vector<CsvColumn>;

// The names of columns, joined by commas: the header row of their table.
std::string CsvHeader(const CsvColumns& columns);

// A table read whole. Every accessor throws DataError naming file, row and column.
class CsvTable {
 public:
  // Throws DataError when the file is missing, its first row is not `header` (column names, joined
  // by commas), or a row has another number of columns. CRLF, empty and '#' rows are accepted.
  static CsvTable Read(const std::string& path, const std::string& header);

  // The same, and throws where a cell is not what its column may hold.
  static CsvTable Read(const std::string& path, const CsvColumns& columns);

  // The same, a row at a time, each as a table of that row alone: long tables are not held.
  static void ForEach(const std::string& path, const CsvColumns& columns,
                      const std::function<void(const CsvTable&)>& visit);

  // The tables of a file whose rows start with the name of the one that they belong to; `columns`
  // has those there can be. All of them are returned. A last row without its end of line was cut
  // off: it is left out and counted.
  static std::map<std::string, CsvTable> ReadTagged(
      const std::string& path, const std::map<std::string, CsvColumns>& columns, int64_t* cut_rows);

  std::size_t rows() const { return rows_.size(); }
  std::size_t columns() const { return columns_.size(); }

  int Int(std::size_t row, std::size_t column) const;  // of a column that is bounded to an int
  int64_t Integer(std::size_t row, std::size_t column) const;
  double Number(std::size_t row, std::size_t column) const;  // finite
  // Nothing for "nan".
  std::optional<double> OptionalNumber(std::size_t row, std::size_t column) const;

  // Throws DataError: that cell is not what was expected.
  [[noreturn]] void Fail(std::size_t row, std::size_t column, const std::string& expected) const;

 private:
  struct Row {
    int line = 0;  // in the file, from 1
    std::vector<std::string> cells;
  };
  // Calls handle after each row that was added.
  static CsvTable ReadRows(const std::string& path, const std::string& header,
                           const std::function<void(CsvTable*)>& handle);
  void AddRow(const std::vector<std::string>& cells, int line);
  void CheckRow(std::size_t row, const CsvColumns& columns) const;

  std::string path_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

// How the rows of a table of stamps are written, to say what is wrong with all of them at once.

class TableText {
 public:
  // `columns`: what a row should hold, for messages.
  TableText(std::string path, std::string columns)
      : path_(std::move(path)), columns_(std::move(columns)) {}

  void AddRead(const std::vector<std::string_view>& fields);
  void AddUnreadable(int row, const std::vector<std::string_view>& fields);

  // Throws InputFault where most rows cannot be read, with one of them, and where numbers have
  // decimal commas, or have lost their points.
  void RequireReadable() const;

  // Stamps as powers of ten, as spreadsheets and C++ streams print large numbers, may have lost
  // digits: throws InputFault where those that are left are more than 1 ms apart.
  void RequireDigits() const;

  // Counts it in warnings where they are coarse, but of use.
  void WarnOfDigits(Warnings* warnings) const;

  // Throws InputFault where most of the rows share their stamps with others: `kept` have their own.
  void RequireStamps(size_t rows, size_t kept) const;

 private:
  std::string path_, columns_;
  int64_t read_ = 0, unreadable_ = 0, decimal_commas_ = 0, pointless_ = 0;
  std::string first_unreadable_, first_decimal_comma_, first_pointless_;  // "row 12: 'text'"
  std::string stamp_;                                                     // one as a power of ten
  double resolution_ns_ = 0;  // the finest of those; 0 where stamps are plain
};

inline constexpr const char* kStampDigits = "stamps_with_lost_digits";

}  // namespace slcmap::data
