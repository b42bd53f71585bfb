// Comma-separated tables with a header row, as the run folder holds them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace slcmap {

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

}  // namespace slcmap
