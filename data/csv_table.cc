#include "data/csv_table.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <sstream>

#include "data/error.h"
#include "data/file.h"
#include "data/text_row.h"

namespace slcmap {

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

}  // namespace slcmap
