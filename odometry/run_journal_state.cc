#include "odometry/run_journal_state.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>

#include "data/error.h"
#include "data/summary_file.h"
#include "odometry/run_json.h"

namespace slcmap {
namespace {

int64_t RowsIn(std::string_view text) { return std::count(text.begin(), text.end(), '\n'); }

std::string InWords(const Json& rows) {
  return fmt::format("{} rows of checksum {}", rows.at("rows").get<int64_t>(),
                     rows.at("checksum").get<std::string>());
}

}  // namespace

void WrittenRows::Add(std::string_view rows) {
  rows_ += RowsIn(rows);
  bytes_ += std::ssize(rows);
  checksum_.Add(rows);
}

Json WrittenRows::ToJson() const {
  return {{"rows", rows_}, {"bytes", bytes_}, {"checksum", checksum_.Text()}};
}

void CheckStart(const std::string& path, const Json& expected) {
  const std::string text = ReadFile(path);
  const auto bytes = expected.at("bytes").get<std::size_t>();
  const Json found = WrittenRows(std::string_view(text).substr(0, bytes)).ToJson();
  if (found == expected) return;
  throw DataError(fmt::format(
      "{}: found {} rows, {} in the first {} bytes, expected {} there as in state.json: {}", path,
      RowsIn(text), InWords(found), bytes, InWords(expected), kChangedSince));
}

void CheckWhole(const std::string& path, const Json& one_of) {
  const Json found = WrittenRows(ReadFile(path)).ToJson();
  if (std::ranges::find(one_of, found) != one_of.end()) return;
  throw DataError(fmt::format("{}: found {}, expected {} as in state.json: {}", path,
                              InWords(found), InWords(one_of.at(0)), kChangedSince));
}

void WriteJournalState(const std::string& path, const OdometryRun& run, const WrittenRows& finished,
                       const std::vector<WrittenRows>& window) {
  Json json = {{"figures", FiguresJson(run.figures)},
               {"warnings", run.warnings},
               {"line_deviation_rad", run.line_deviation_rad},
               {"finished", finished.ToJson()},
               {"window", Json::array()}};
  for (const WrittenRows& rows : window) json["window"].push_back(rows.ToJson());
  WriteSummaryFile(path + ".new", json);
  PutInPlace(path);
}

Json ReadJournalState(const std::string& path, OdometryRun* run) {
  return ParseJsonFile(path, [&](const Json& json) {
    OdometryRun so_far;  // all of it, or nothing
    ParseSoFar(path, json, &so_far);
    run->figures = so_far.figures;
    run->warnings = so_far.warnings;
    run->line_deviation_rad = so_far.line_deviation_rad;
    return json;
  });
}

void PutInPlace(const std::string& path) {
  std::error_code error;
  std::filesystem::rename(path + ".new", path, error);
  if (error) throw OutputError(path + ": cannot be written: " + error.message());
}

}  // namespace slcmap
