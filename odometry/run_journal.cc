#include "odometry/run_journal.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <unordered_set>
#include <utility>

#include "data/error.h"
#include "data/file.h"
#include "odometry/finite_run.h"
#include "odometry/run_json.h"
#include "odometry/run_lines.h"
#include "odometry/run_rows.h"
#include "odometry/run_source.h"

namespace slcmap {
namespace {

constexpr char kHeader[] = "header.json";
constexpr char kJournalRig[] = "rig.json";
constexpr char kFinished[] = "finished.csv";
constexpr char kWindow[] = "window.csv";
constexpr char kFigures[] = "figures.json";
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
      AddRow(kObservationTable, Row(keyframe.id, seen), &rows);
    }
    for (const auto& seen : keyframe.lines) {
      AddRow(kLineObservationTable, Row(keyframe.id, seen), &rows);
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

// A reader finds the old text or the new one.
void Replace(const std::string& path, const std::string& text) {
  const std::string aside = path + ".new";
  WriteFile(aside, text);
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  if (error) throw OutputError(path + ": cannot be written: " + error.message());
}

int64_t Now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace

RunJournal::RunJournal(const std::string& run_folder, const OdometryRun& header)
    : folder_(run_folder), synced_at_ns_(Now_ns()) {
  MakeFolder(run_folder + "/" + kJournalFolder);
  const std::string path = JournalPath(run_folder, kFinished);
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) throw OutputError(path + ": cannot be created: " + std::strerror(errno));
  WriteRig(JournalPath(run_folder, kJournalRig), header.rectified_rig);
  if (header.source) WriteRunSource(run_folder + "/" + kJournalFolder, *header.source);
  // Last: without it there is no journal.
  WriteJsonFile(JournalPath(run_folder, kHeader), HeaderJson(header));
}

RunJournal::~RunJournal() {
  if (sync_.valid()) sync_.wait();
  close(file_);
}

void RunJournal::Append(const OdometryRun& finished) {
  const std::string rows = TaggedRows(IsFinite(finished) ? finished : WithoutNonFinite(finished));
  for (std::size_t done = 0; done < rows.size();) {
    const ssize_t count = write(file_, rows.data() + done, rows.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw OutputError(JournalPath(folder_, kFinished) +
                        ": cannot be written: " + std::strerror(errno));
    }
    done += static_cast<std::size_t>(count);
  }
  SyncNowAndThen();
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
  Replace(JournalPath(folder_, kWindow),
          TaggedRows(IsFinite(window) ? window : WithoutNonFinite(window)));
  Replace(JournalPath(folder_, kFigures), FiguresJson(window.figures).dump() + "\n");
}

bool HasRunJournal(const std::string& run_folder) {
  return std::filesystem::exists(JournalPath(run_folder, kHeader));
}

OdometryRun ReadRunJournal(const std::string& run_folder) {
  OdometryRun run, window;
  const std::string header = JournalPath(run_folder, kHeader);
  ParseJsonFile(header, [&](const Json& json) {
    ParseHeader(header, json, &run);
    return true;
  });
  run.rectified_rig = ReadRig(JournalPath(run_folder, kJournalRig));
  if (run.source) ReadRunSource(run_folder + "/" + kJournalFolder, &*run.source);
  if (const std::string figures = JournalPath(run_folder, kFigures);
      std::filesystem::exists(figures)) {
    run.figures =
        ParseJsonFile(figures, [&](const Json& json) { return ParseFigures(figures, json); });
  }
  int64_t cut_rows = 0;
  auto finished = CsvTable::ReadTagged(JournalPath(run_folder, kFinished), RunColumns(), &cut_rows);
  const std::string window_path = JournalPath(run_folder, kWindow);
  const bool has_window = std::filesystem::exists(window_path);
  auto newest = has_window ? CsvTable::ReadTagged(window_path, RunColumns(), &cut_rows)
                           : std::map<std::string, CsvTable>();
  // Each file has those that its lines refer to; those of the window are newer.
  ReadWorlds(finished[kWorldTable], &run);
  ReadWorlds(newest[kWorldTable], &run);
  ReadSlopes(finished[kSlopeTable], &run);
  ReadSlopes(newest[kSlopeTable], &run);
  window.manhattan_worlds = run.manhattan_worlds;
  window.sloped_directions = run.sloped_directions;
  ReadTables(finished, &run);
  if (has_window) ReadTables(newest, &window);
  AddMissing(std::move(window.keyframes), &run.keyframes);
  AddMissing(std::move(window.landmarks), &run.landmarks);
  AddMissing(std::move(window.lines), &run.lines);
  AddNewer(window.calibration, &run);
  ReadLineMerges(newest[kLineMergeTable], &run);
  ResolveMergedLines(&run);
  if (cut_rows > 0) run.warnings["rows of the journal that were cut off"] = cut_rows;
  run.partial_reason =
      fmt::format("cut off after {} poses: the program that wrote it was ended before it was done",
                  run.states.size());
  return run;
}

}  // namespace slcmap
