#include "data/csv_table.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "data/error.h"
#include "data/text_row.h"

namespace slcmap {

CsvTable CsvTable::Read(const std::string& path, const std::string& header) {
  CsvTable table;
  table.path_ = path;
  ForEachRow(path, [&](int line, const std::vector<std::string_view>& fields) {
    const std::vector<std::string> cells(fields.begin(), fields.end());
    if (!table.columns_.empty()) {
      table.AddRow(cells, line);
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

void CsvTable::Fail(std::size_t row, std::size_t column, const char* expected) const {
  throw DataError(fmt::format("{}: row {}: {}: found '{}', expected {}", path_, rows_[row].line,
                              columns_[column], rows_[row].cells[column], expected));
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

}  // namespace slcmap
