// Comma-separated tables with a header row, as the run folder holds them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace slcmap {

// A table read whole. Every accessor throws DataError naming file, row and column.
class CsvTable {
 public:
  // Throws DataError when the file is missing, its first row is not `header` (column names, joined
  // by commas), or a row has another number of columns. CRLF, empty and '#' rows are accepted.
  static CsvTable Read(const std::string& path, const std::string& header);

  std::size_t rows() const { return rows_.size(); }

  int64_t Integer(std::size_t row, std::size_t column) const;
  double Number(std::size_t row, std::size_t column) const;  // finite
  // Nothing for "nan".
  std::optional<double> OptionalNumber(std::size_t row, std::size_t column) const;

  // Throws DataError: that cell is not what was expected.
  [[noreturn]] void Fail(std::size_t row, std::size_t column, const char* expected) const;

 private:
  struct Row {
    int line = 0;  // in the file, from 1
    std::vector<std::string> cells;
  };
  void AddRow(const std::vector<std::string>& cells, int line);

  std::string path_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace slcmap
