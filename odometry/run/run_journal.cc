#include "odometry/run/run_journal.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "odometry/run/run.h"
#include "odometry/run/run_json.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline odometry {

// How many rows were written, and their checksum.
class WrittenRows {
 public:
  WrittenRows() = default;
  explicit WrittenRows(std::string_view rows) { Add(rows); }
  void Add(std::string_view rows);
  Json ToJson() const;

 private:
  int64_t rows_ = 0, bytes_ = 0;
  RunningChecksum checksum_;
};

// Throw DataError unless a file starts with those rows, or is one of several.
void CheckStart(const std::string& path, const Json& expected);
void CheckWhole(const std::string& path, const Json& one_of);

// Replaces the journal's state.json, which holds the figures, warnings and line deviation of `run`,
// what finished.csv starts with, and what window.csv may be, the newest first. Throws OutputError.
void WriteJournalState(const std::string& path, const OdometryRun& run, const WrittenRows& finished,
                       const std::vector<WrittenRows>& window);

// Fills what WriteJournalState() took from a run; returns the whole. Throws DataError.
Json ReadJournalState(const std::string& path, OdometryRun* run);

// Renames PATH.new: a reader finds the old file or the new one. Throws OutputError.
void PutInPlace(const std::string& path);

namespace {

constexpr char kRawRig[] = "raw_rig.json";
constexpr char kOptions[] = "options.yaml";
constexpr char kImages[] = "images.csv";
constexpr char kImageHeader[] = "stamp_ns,left,right";

}  // namespace

std::vector<std::string> RunSourceFiles() { return {kRawRig, kOptions, kImages}; }

void WriteRunSource(const std::string& folder, const RunSource& source) {
  WriteRig(folder + "/" + kRawRig, source.raw_rig);
  WriteFile(folder + "/" + kOptions, source.options);
  std::string rows = kImageHeader;
  for (int i = 2; i < CameraCount(source.raw_rig); ++i) rows += fmt::format(",camera_{}", i);
  rows += "\n";
  for (const StereoEntry& images : source.images) {
    rows += fmt::format("{},{},{}", images.stamp_ns, images.left_path, images.right_path);
    for (const std::string& path : images.other_paths) rows += "," + path;
    rows += "\n";
  }
  WriteFile(folder + "/" + kImages, rows);
}

void ReadRunSource(const std::string& folder, RunSource* source) {
  source->raw_rig = ReadRig(folder + "/" + kRawRig);
  source->options = ReadFile(folder + "/" + kOptions);
  const std::string path = folder + "/" + kImages;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    if (row == 1) return;  // the names of the columns
    const auto stamp_ns = ParseScaledInteger(fields[0], 0);
    if (!stamp_ns || fields.size() < 2 || fields.size() > 1 + source->raw_rig.cameras.size()) {
      throw DataError(fmt::format("{}: row {}: found '{}', expected {}", path, row,
                                  fmt::join(fields, ","), kImageHeader));
    }
    StereoEntry& images = source->images.emplace_back(StereoEntry{
        *stamp_ns, std::string(fields[1]), fields.size() > 2 ? std::string(fields[2]) : ""});
    for (size_t i = 3; i < fields.size(); ++i) images.other_paths.emplace_back(fields[i]);
  });
}

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

namespace {

constexpr char kHeader[] = "header.json";
constexpr char kJournalRig[] = "rig.json";
constexpr char kFinished[] = "finished.csv";
constexpr char kWindow[] = "window.csv";
constexpr char kState[] = "state.json";
// Starts window.csv, so that one of no rows is told from an emptied file.
constexpr char kWindowTitle[] = "# window\n";
constexpr int64_t kSyncEvery_ns = 10'000'000'000;

std::string JournalPath(const std::string& run_folder, const char* name) {
  return run_folder + "/" + kJournalFolder + "/" + name;
}

void AddRow(const char* table, const std::string& row, std::string* rows) {
  *rows += table;
  *rows += ',';
  *rows += row;
}

// What is referred to comes first, so that a part from the start is whole.
std::string TaggedRows(const OdometryRun& run) {
  std::string rows;
  for (const ImuSample& sample : run.imu) AddRow(kImuTable, Row(sample), &rows);
  for (const OnlineState& state : run.states) AddRow(kStateTable, Row(state), &rows);
  for (std::size_t i = 0; i < run.manhattan_worlds.size(); ++i) {
    AddRow(kWorldTable, Row(static_cast<int64_t>(i), run.manhattan_worlds[i]), &rows);
  }
  for (std::size_t i = 0; i < run.sloped_directions.size(); ++i) {
    AddRow(kSlopeTable, Row(static_cast<int64_t>(i), run.sloped_directions[i]), &rows);
  }
  for (const Landmark& landmark : run.landmarks) AddRow(kLandmarkTable, Row(landmark), &rows);
  for (const Keyframe& keyframe : run.keyframes) {
    AddRow(kKeyframeTable, Row(keyframe), &rows);
    for (const auto& seen : keyframe.observations) {
      AddRow(kObservationTable, Row(keyframe.id, seen, NamesCameras(run)), &rows);
    }
    for (const auto& seen : keyframe.lines) {
      AddRow(kLineObservationTable, Row(keyframe.id, seen, NamesCameras(run)), &rows);
    }
  }
  for (const CalibrationEstimate& e : run.calibration) AddRow(kCalibrationTable, Row(e), &rows);
  for (const Line& line : run.lines) {
    AddRow(kLineTable, Row(line), &rows);
    for (const int64_t id : line.point_ids) AddRow(kLinePointTable, Row(line.id, id), &rows);
  }
  for (const auto& [id, survivor] : run.line_merges) {
    AddRow(kLineMergeTable, Row(id, survivor), &rows);
  }
  return rows;
}

// The items that `run` lacks, by id.
template <typename Item>
void AddMissing(std::vector<Item>&& items, std::vector<Item>* run) {
  std::unordered_set<int64_t> known;
  for (const Item& item : *run) known.insert(item.id);
  for (Item& item : items) {
    if (!known.contains(item.id)) run->push_back(std::move(item));
  }
}

// What the window knows of the calibration, where that is newer.
void AddNewer(const std::vector<CalibrationEstimate>& window, OdometryRun* run) {
  for (const CalibrationEstimate& estimate : window) {
    if (run->calibration.empty() || run->calibration.back().stamp_ns < estimate.stamp_ns) {
      run->calibration.push_back(estimate);
    }
  }
}

// Fills a run, which has its Manhattan worlds, from a file of tagged rows.
void ReadTables(std::map<std::string, CsvTable>& tables, OdometryRun* run) {
  ReadImu(tables[kImuTable], run);
  ReadStates(tables[kStateTable], run);
  ReadKeyframes(tables[kKeyframeTable], run);
  ReadObservations(tables[kObservationTable], run);
  ReadLineObservations(tables[kLineObservationTable], run);
  ReadLandmarks(tables[kLandmarkTable], run);
  ReadLines(tables[kLineTable], run);
  ReadLinePoints(tables[kLinePointTable], run);
  ReadCalibration(tables[kCalibrationTable], run);
}

// Fills a run from finished.csv and window.csv.
void ReadRows(const std::string& run_folder, OdometryRun* run) {
  int64_t cut_rows = 0;
  const auto& columns = RunColumns(NamesCameras(*run));
  auto finished = CsvTable::ReadTagged(JournalPath(run_folder, kFinished), columns, &cut_rows);
  auto newest = CsvTable::ReadTagged(JournalPath(run_folder, kWindow), columns, &cut_rows);
  // Each file has those that its lines refer to; those of the window are newer.
  ReadWorlds(finished[kWorldTable], run);
  ReadWorlds(newest[kWorldTable], run);
  ReadSlopes(finished[kSlopeTable], run);
  ReadSlopes(newest[kSlopeTable], run);
  OdometryRun window;
  window.rectified_rig = run->rectified_rig;
  window.manhattan_worlds = run->manhattan_worlds;
  window.sloped_directions = run->sloped_directions;
  ReadTables(finished, run);
  ReadTables(newest, &window);
  AddMissing(std::move(window.keyframes), &run->keyframes);
  AddMissing(std::move(window.landmarks), &run->landmarks);
  AddMissing(std::move(window.lines), &run->lines);
  AddNewer(window.calibration, run);
  ReadLineMerges(newest[kLineMergeTable], run);
  ResolveMergedLines(run);
  if (cut_rows > 0) run->warnings["rows of the journal that were cut off"] = cut_rows;
}

void AddCounts(const std::map<std::string, int64_t>& counts, std::map<std::string, int64_t>* all) {
  for (const auto& [kind, count] : counts) (*all)[kind] += count;
}

// What is not finite is left out and counted.
std::string FiniteRows(const OdometryRun& run, std::map<std::string, int64_t>* left_out) {
  if (IsFinite(run)) return TaggedRows(run);
  OdometryRun finite = run;
  finite.warnings.clear();
  finite = WithoutNonFinite(std::move(finite));
  AddCounts(finite.warnings, left_out);
  return TaggedRows(finite);
}

void WriteHeader(const std::string& run_folder, const OdometryRun& header) {
  const std::string folder = run_folder + "/" + kJournalFolder;
  std::vector<std::string> files = {kJournalRig};
  WriteRig(folder + "/" + kJournalRig, header.rectified_rig);
  if (header.source) {
    WriteRunSource(folder, *header.source);
    for (const std::string& name : RunSourceFiles()) files.push_back(name);
  }
  Json json = HeaderJson(header);
  json["files"] = ListFiles(folder, files);
  WriteSummaryFile(folder + "/" + kHeader, json);
}

Json ReadHeader(const std::string& run_folder, OdometryRun* run) {
  const std::string path = JournalPath(run_folder, kHeader);
  const Json header = ParseJsonFile(path, [&](const Json& json) {
    ParseHeader(path, json, run);
    return json;
  });
  run->rectified_rig = ReadRig(JournalPath(run_folder, kJournalRig));
  if (run->source) ReadRunSource(run_folder + "/" + kJournalFolder, &*run->source);
  return header;
}

// Throws DataError unless all files are as they were written.
void CheckJournal(const std::string& run_folder, const Json& header, const Json& state) {
  const std::string folder = run_folder + "/" + kJournalFolder;
  WithJsonErrors(folder + "/" + kHeader, [&] { CheckFiles(folder, kHeader, header); });
  WithJsonErrors(folder + "/" + kState, [&] {
    CheckSummary(folder, kState, state);
    CheckStart(folder + "/" + kFinished, state.at("finished"));
    CheckWhole(folder + "/" + kWindow, state.at("window"));
  });
}

int64_t Now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace

// What the files hold.
struct RunJournal::Written {
  WrittenRows finished, window;
};

RunJournal::RunJournal(const std::string& run_folder, const OdometryRun& header)
    : folder_(run_folder), written_(std::make_unique<Written>()), synced_at_ns_(Now_ns()) {
  MakeFolder(run_folder + "/" + kJournalFolder);
  const std::string path = JournalPath(run_folder, kFinished);
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) throw OutputError(path + ": cannot be created: " + std::strerror(errno));
  SetWindow({});
  WriteHeader(run_folder, header);  // last: without it there is no journal
}

RunJournal::~RunJournal() {
  if (sync_.valid()) sync_.wait();
  close(file_);
}

void RunJournal::Append(const OdometryRun& finished) {
  Write(FiniteRows(finished, &left_out_));
  SyncNowAndThen();
}

void RunJournal::Write(const std::string& rows) {
  for (std::size_t done = 0; done < rows.size();) {
    const ssize_t count = write(file_, rows.data() + done, rows.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw OutputError(JournalPath(folder_, kFinished) +
                        ": cannot be written: " + std::strerror(errno));
    }
    done += static_cast<std::size_t>(count);
  }
  written_->finished.Add(rows);
}

// Against a failing power supply; beside the caller, as it may take long.
void RunJournal::SyncNowAndThen() {
  const int64_t now_ns = Now_ns();
  if (now_ns - synced_at_ns_ < kSyncEvery_ns) return;
  synced_at_ns_ = now_ns;
  if (sync_.valid()) sync_.wait();
  sync_ = std::async(std::launch::async, [file = file_] { fdatasync(file); });
}

void RunJournal::SetWindow(const OdometryRun& window) {
  OdometryRun so_far;
  so_far.figures = window.figures;
  so_far.line_deviation_rad = window.line_deviation_rad;
  so_far.warnings = window.warnings;
  AddCounts(left_out_, &so_far.warnings);
  const std::string rows = kWindowTitle + FiniteRows(window, &so_far.warnings),
                    path = JournalPath(folder_, kWindow);
  const WrittenRows newest(rows);
  WriteFile(path + ".new", rows);
  WriteJournalState(JournalPath(folder_, kState), so_far, written_->finished,
                    {newest, written_->window});
  PutInPlace(path);
  written_->window = newest;
}

bool HasRunJournal(const std::string& run_folder) {
  return std::filesystem::exists(JournalPath(run_folder, kHeader));
}

OdometryRun ReadRunJournal(const std::string& run_folder, bool accept_changed) {
  OdometryRun run;
  const Json header = ReadHeader(run_folder, &run);
  Json state;
  ReadOrLeaveOut(accept_changed, "journal_state_unreadable", &run,
                 [&] { state = ReadJournalState(JournalPath(run_folder, kState), &run); });
  ReadRows(run_folder, &run);
  if (!accept_changed) CheckJournal(run_folder, header, state);
  run.partial_reason =
      fmt::format("cut off after {} poses: the program that wrote it was ended before it was done",
                  run.states.size());
  return run;
}

}  // namespace slcmap::odometry
