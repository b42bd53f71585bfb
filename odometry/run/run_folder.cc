#include "odometry/run/run_folder.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/map_line.h"
#include "data/io/ply.h"
#include "data/io/trajectory.h"
#include "odometry/run/run_journal.h"
#include "odometry/run/run_json.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline odometry {
namespace {

constexpr char kSummary[] = "run.json";
constexpr char kTimings[] = "timings.json";  // not the same each time, and nothing depends on it
constexpr char kRig[] = "rig.json";
constexpr char kPoints[] = "points.ply";

// A file that is one table.
struct TableFile {
  const char* name;
  const char* table;
  void (*read)(const CsvTable&, OdometryRun*);
  bool newer = false;  // than the version: runs that do not list it may lack it
};
// In the order in which they are read: what is referred to comes first.
constexpr TableFile kTables[] = {
    {"states.csv", kStateTable, ReadStates},
    {"keyframes.csv", kKeyframeTable, ReadKeyframes},
    {"observations.csv", kObservationTable, ReadObservations},
    {"lines.csv", kLineTable, ReadLines},
    {"line_observations.csv", kLineObservationTable, ReadLineObservations},
    {"line_points.csv", kLinePointTable, ReadLinePoints},
    {"imu.csv", kImuTable, ReadImu},
    {"line_merges.csv", kLineMergeTable, ReadLineMerges},
    {"calibration.csv", kCalibrationTable, ReadCalibration, true}};

// Everything that run.json lists.
std::vector<std::string> ListedNames(bool with_source) {
  std::vector<std::string> names = {"trajectory.tum", kPoints, "lines.ply", kRig};
  for (const TableFile& file : kTables) names.push_back(file.name);
  if (with_source) {
    for (const std::string& name : RunSourceFiles()) names.push_back(name);
  }
  return names;
}

// The rows of one table.
template <typename Items>
std::string CollectRows(const Items& items) {
  std::string rows;
  for (const auto& item : items) rows += Row(item);
  return rows;
}

std::string FormatTable(const OdometryRun& run, const std::string& table) {
  std::string rows;
  if (table == kStateTable) return CollectRows(run.states);
  if (table == kKeyframeTable) return CollectRows(run.keyframes);
  if (table == kLineTable) return CollectRows(run.lines);
  if (table == kImuTable) return CollectRows(run.imu);
  if (table == kCalibrationTable) return CollectRows(run.calibration);
  if (table == kLineMergeTable) {
    for (const auto& [id, survivor] : run.line_merges) rows += Row(id, survivor);
    return rows;
  }
  for (const Keyframe& keyframe : run.keyframes) {
    if (table == kObservationTable) {
      for (const auto& seen : keyframe.observations)
        rows += Row(keyframe.id, seen, NamesCameras(run));
    } else if (table == kLineObservationTable) {
      for (const auto& seen : keyframe.lines) rows += Row(keyframe.id, seen, NamesCameras(run));
    }
  }
  if (table != kLinePointTable) return rows;
  for (const Line& line : run.lines) {
    for (const int64_t id : line.point_ids) rows += Row(line.id, id);
  }
  return rows;
}

void WriteTables(const std::string& folder, const OdometryRun& run) {
  for (const TableFile& file : kTables) {
    WriteFile(folder + "/" + file.name, CsvHeader(RunColumns(NamesCameras(run)).at(file.table)) +
                                            "\n" + FormatTable(run, file.table));
  }
}

void WriteTrajectory(const std::string& path, const std::vector<OnlineState>& states) {
  Trajectory trajectory;
  for (const OnlineState& state : states) {
    trajectory.push_back({state.stamp_ns, state.T_world_imu});
  }
  WriteTumTrajectory(path, trajectory);
}

void WriteLandmarks(const std::string& path, const std::vector<Landmark>& landmarks) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "sigma_m"}) vertices.Add(name, PlyType::kFloat);
  for (const char* name : {"id", "observations", "segment"}) vertices.Add(name, PlyType::kInt32);
  for (const Landmark& landmark : landmarks) {
    vertices.AppendRow({landmark.p_world.x(), landmark.p_world.y(), landmark.p_world.z(),
                        landmark.sigma_m, static_cast<double>(landmark.id),
                        static_cast<double>(landmark.observations),
                        static_cast<double>(landmark.segment)});
  }
  WritePly(path, {{"slcmap landmarks, metres in the world frame"}, {vertices}, {}});
}

// The columns of points.ply are those of the table, under PLY's names.
std::vector<Landmark> ReadLandmarkFile(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const auto column = [&](const char* name, double least, double most) {
    return vertices.Bounded(name, least, most, path);
  };
  const std::vector<double> x = column("x", -kMaxCoordinate_m, kMaxCoordinate_m),
                            y = column("y", -kMaxCoordinate_m, kMaxCoordinate_m),
                            z = column("z", -kMaxCoordinate_m, kMaxCoordinate_m),
                            sigma_m = column("sigma_m", 0, kMaxSigma_m),
                            id = column("id", 0, kMaxId),
                            observations = column("observations", 0, kMaxId),
                            segment = column("segment", 0, kMaxSegment);
  vertices.CheckUnique("id", path);
  std::vector<Landmark> landmarks(vertices.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    landmarks[i].p_world = {x[i], y[i], z[i]};
    landmarks[i].sigma_m = sigma_m[i];
    landmarks[i].id = static_cast<int64_t>(id[i]);
    landmarks[i].observations = static_cast<int>(observations[i]);
    landmarks[i].segment = static_cast<int>(segment[i]);
  }
  return landmarks;
}

void CheckCounts(const std::string& folder, const Json& summary, const OdometryRun& run) {
  for (const auto& [what, count] : RunCounts(run)) {
    CheckCount(folder, kSummary, summary, what, count);
  }
}

OdometryRun ReadWholeRun(const std::string& folder, const FolderReadOptions& options) {
  OdometryRun run;
  const Json summary = ReadRunSummary(folder + "/" + kSummary, &run);
  run.rectified_rig = ReadRig(folder + "/" + kRig);
  for (const TableFile& file : kTables) {
    const std::string path = folder + "/" + file.name;
    if (file.newer && !std::filesystem::exists(path)) continue;  // what is listed is checked below
    file.read(CsvTable::Read(path, RunColumns(NamesCameras(run)).at(file.table)), &run);
  }
  run.landmarks = ReadLandmarkFile(folder + "/" + kPoints);
  if (run.source) ReadRunSource(folder, &*run.source);
  ReadOrLeaveOut(options.accept_changed, "timings_unreadable", &run,
                 [&] { run.timings = ReadTimings(folder + "/" + kTimings); });
  if (options.accept_changed) return run;
  WithJsonErrors(folder + "/" + kSummary, [&] {
    CheckCounts(folder, summary, run);
    CheckFiles(folder, kSummary, summary);
  });
  return run;
}

}  // namespace

StageFiles RunFiles() {
  StageFiles files{"a run", {kSummary, kTimings, kJournalFolder}};
  for (const std::string& name : ListedNames(true)) files.names.push_back(name);
  return files;
}

void WriteRunFolder(const std::string& folder, const OdometryRun& run) {
  OutputFolder output(folder, RunFiles());
  WriteRunFolder(&output, run);
}

void WriteRunFolder(OutputFolder* folder, const OdometryRun& run) {
  // The copy of a long run is worth avoiding.
  if (!IsFinite(run)) return WriteRunFolder(folder, WithoutNonFinite(run));
  const std::string& path = folder->staging();
  WriteTables(path, run);
  WriteTrajectory(path + "/trajectory.tum", run.states);
  WriteLandmarks(path + "/" + kPoints, run.landmarks);
  WriteMapLines(path + "/lines.ply", MapLines(run));
  WriteRig(path + "/" + kRig, run.rectified_rig);
  if (run.source) WriteRunSource(path, *run.source);
  WriteTimings(path + "/" + kTimings, run.timings);
  WriteRunSummary(path + "/" + kSummary, run, ListedNames(run.source.has_value()));
  folder->Commit(run.complete && !run.states.empty());
  // A run that is there as a whole needs no journal.
  std::filesystem::remove_all(folder->path() + "/" + kJournalFolder);
}

OdometryRun ReadRunFolder(const std::string& folder, const FolderReadOptions& options) {
  const InputLock lock(folder);
  const bool finished = std::filesystem::exists(folder + "/" + kSummary);
  return !finished && HasRunJournal(folder) ? ReadRunJournal(folder, options.accept_changed)
                                            : ReadWholeRun(folder, options);
}

std::string RunIdIn(const std::string& folder) {
  OdometryRun run;
  try {
    ReadRunSummary(folder + "/" + kSummary, &run);
  } catch (const DataError&) {
    return "";
  }
  return run.id;
}

}  // namespace slcmap::odometry
