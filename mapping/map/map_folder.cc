#include "mapping/map/map_folder.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/ply.h"
#include "data/io/pose_file.h"
#include "data/io/trajectory.h"
#include "data/source/sequence_options_json.h"
#include "mapping/map/building.h"
#include "mapping/map/evidence_files.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/part_files.h"
#include "mapping/map/place_index.h"
#include "odometry/run/run.h"
#include "odometry/run/run_json.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline mapping {
namespace {

constexpr int kMapVersion = 4;
constexpr char kSummary[] = "map.json";

// The files of a map folder besides its summary.
constexpr char kTrajectory[] = "trajectory.tum", kKeyframes[] = "keyframes.tum",
               kPoints[] = "points.ply", kCloud[] = "points.pcd", kDense[] = "dense.ply",
               kDenseCloud[] = "dense.pcd", kLines[] = "lines.ply", kMarks[] = "marks.ply",
               kOccupancy[] = "occupancy.bt", kRig[] = "rig.json", kOptions[] = "options.yaml",
               kCalibration[] = "calibration.yaml", kProbabilities[] = "occupancy.ot";

double MedianObservations(const std::vector<MapLine>& lines) {
  std::vector<int> observations;
  for (const MapLine& line : lines) {
    if (!IsJunction(line)) observations.push_back(line.observations);
  }
  return ComputeTrackLengths(std::move(observations)).median_keyframes;
}

std::vector<std::string> ListedNames(bool with_calibration, bool with_plan, bool with_control) {
  std::vector<std::string> names = {
      kTrajectory, kKeyframes, kPoints,   kCloud,       kDense,
      kDenseCloud, kLines,     kMarks,    kOccupancy,   kProbabilities,
      kRig,        kOptions,   kPipeFile, kPatternFile, kPointObservationFile,
      kPlaceFile};
  for (const std::string& name : LineEvidenceFiles()) names.push_back(name);
  for (const std::string& name : BuildingFiles()) names.push_back(name);
  if (with_calibration) names.emplace_back(kCalibration);
  if (with_plan)
    names.insert(names.end(), kPlanComparisonFiles.begin(), kPlanComparisonFiles.end());
  if (with_control) names.insert(names.end(), kControlFiles.begin(), kControlFiles.end());
  return names;
}

Json AdjustmentJson(const std::optional<AdjustmentFigures>& figures) {
  if (!figures) return nullptr;
  return {{"points", figures->points},
          {"point_observations", figures->point_observations},
          {"rejected_point_observations", figures->rejected_point_observations},
          {"lines", figures->lines},
          {"line_observations", figures->line_observations},
          {"rejected_line_observations", figures->rejected_line_observations},
          {"closures", figures->closures},
          {"closures_taken_back", figures->closures_rejected},
          {"matched_points", figures->matched_points},
          {"matched_edges", figures->matched_edges},
          {"iterations", figures->iterations}};
}

Json ExternalPosesJson(const std::optional<ExternalPoseFigures>& figures) {
  if (!figures) return nullptr;
  return {{"views", figures->views},
          {"pairs", figures->pairs},
          {"points", figures->points},
          {"given_off_px", figures->given_off_px},
          {"off_px", figures->off_px},
          {"body_turned_rad", figures->body_turned_rad},
          {"body_shifted_m", figures->body_shifted_m},
          {"clock_s", figures->clock_s},
          {"moved_m", figures->moved_m},
          {"turned_rad", figures->turned_rad}};
}

// What of it people want to know first; the rest is in its own files.
Json ComparisonJson(const PlanComparison& comparison) {
  Json json = {{"file", comparison.plan},
               {"storey", comparison.storey},
               {"agreeing_m", RoundedForJson(comparison.agreeing_m)},
               {"differing_m", RoundedForJson(comparison.differing_m)}};
  const auto count = [&](const char* what, const auto& rows) {
    for (const char* status : kPlanStatuses) {
      json[what][status] = std::ranges::count_if(
          rows, [&](const auto& row) { return std::string(GetName(row.status)) == status; });
    }
  };
  count("walls", comparison.walls);
  count("openings", comparison.openings);
  return json;
}

std::vector<std::pair<const char*, std::size_t>> CountContents(const MapResult& map) {
  return {{"poses", map.trajectory.size()},
          {"keyframes", map.keyframes.size()},
          {"points", map.points.size()},
          {"point_observations", map.point_observations.size()},
          {"dense_points", CountDense(map)},
          {"lines", map.lines.size()},
          {"marks", map.marks.size()},
          {"line_covariances", map.line_evidence.covariances.size()},
          {"line_supports", map.line_evidence.supports.size()},
          {"pipes", map.pipes.size()},
          {"patterns", map.patterns.size()},
          {"planes", map.building.planes.size()},
          {"rooms", map.building.rooms.size()},
          {"occupied_voxels", map.occupancy.OccupiedVoxels().size()}};
}

template <typename Part>
Json SeenSharesJson(const std::vector<Part>& parts) {
  Json json = Json::array();
  for (const Part& part : parts) {
    if (part.seen_share) json.push_back({{"id", part.id}, {"share", *part.seen_share}});
  }
  return json;
}

Json SeenShareJson(const MapResult& map) {
  if (!map.seen_share) return nullptr;
  return {{"share", *map.seen_share},
          {"rooms", SeenSharesJson(map.building.rooms)},
          {"walls", SeenSharesJson(map.building.walls)}};
}

double ParseShare(const std::string& path, const Json& json) {
  const double share = json.at("share").get<double>();
  if (share >= 0 && share <= 1) return share;
  throw DataError(fmt::format("{}: seen_share: found {}, expected 0 to 1", path, share));
}

template <typename Part>
void ParseSeenShares(const std::string& path, const Json& json, std::vector<Part>* parts) {
  for (const Json& of_part : json) {
    const auto id = of_part.at("id").get<int64_t>();
    const auto part = std::ranges::find(*parts, id, &Part::id);
    if (part == parts->end()) {
      throw DataError(
          fmt::format("{}: seen_share: found the id {}, which no room or wall has", path, id));
    }
    part->seen_share = ParseShare(path, of_part);
  }
}

void ReadSeenShare(const std::string& path, const Json& summary, MapResult* map) {
  WithJsonErrors(path, [&] {
    const Json& json = summary.at("seen_share");
    if (json.is_null()) return;
    map->seen_share = ParseShare(path, json);
    ParseSeenShares(path, json.at("rooms"), &map->building.rooms);
    ParseSeenShares(path, json.at("walls"), &map->building.walls);
  });
}

std::string WriteSummary(const std::string& folder, const MapResult& map) {
  Json json = {{"format", "slcmap map"},
               {"version", kMapVersion},
               {"method", map.method},
               {"source",
                {{"run", map.source.run_id},
                 {"yaw_rad", YawOfWorld(map.source.T_world_run)},
                 {"georeference", GeoreferenceJson(map.source.georeference)},
                 {"slcmap", map.source.version},
                 {"sequence", map.source.sequence},
                 {"opened", OpenedJson(map.source.opened)}}},
               {"complete", map.complete},
               {"partial_reason", map.partial_reason},
               {"interrupted", map.interrupted},
               {"verdict", VerdictJson(map.verdict)},
               {"seen_share", SeenShareJson(map)},
               {"warnings", Json(map.warnings)},
               {"median_line_observations", MedianObservations(map.lines)},
               {"voxel_m", map.occupancy.resolution_m()},
               {"adjustment", AdjustmentJson(map.adjustment)},
               {"given_poses", ExternalPosesJson(map.given_poses)}};
  if (map.plan) json["plan"] = ComparisonJson(*map.plan);
  if (!map.source.merged.empty()) json["merged"] = MergedJson(map.source.merged);
  for (const auto& [what, count] : CountContents(map)) json["counts"][what] = count;
  json["files"] = ListFiles(folder, ListedNames(map.calibrated_rig.has_value(),
                                                map.plan.has_value(), map.control.has_value()));
  return WriteSummaryFile(folder + "/" + kSummary, json);
}

Json ReadSummary(const std::string& path, MapResult* map) {
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, "slcmap map", kMapVersion, kMapVersion);
    map->id = json.at("id").get<std::string>();
    map->method = json.at("method").get<std::string>();
    CheckMethodName(path, map->method);
    const Json& source = json.at("source");
    map->source.run_id = source.at("run").get<std::string>();
    map->source.version = source.at("slcmap").get<std::string>();
    map->source.sequence = source.at("sequence").get<std::string>();
    map->source.opened = ParseOpened(source);
    map->source.T_world_run = ParseTurn(path + ": source", source);
    map->source.georeference = ParseGeoreference(path + ": source", source);
    if (json.contains("merged"))
      map->source.merged = ParseMerged(path, json.at("merged"), map->source);
    map->complete = json.at("complete").get<bool>();
    map->partial_reason = json.at("partial_reason").get<std::string>();
    map->interrupted = json.at("interrupted").get<bool>();
    map->warnings = ParseWarnings(path, json.at("warnings"));
    map->verdict = ParseVerdict(path, json);
    return json;
  });
}

void CheckCounts(const std::string& folder, const Json& summary, const MapResult& map) {
  for (const auto& [what, count] : CountContents(map)) {
    CheckCount(folder, kSummary, summary, what, count);
  }
}

// Whether a map has a file that not all have: it is there, or should be.
bool HasFile(const std::string& folder, const Json& summary, const char* name) {
  if (std::filesystem::exists(folder + "/" + name)) return true;
  return WithJsonErrors(folder + "/" + kSummary, [&] {
    return std::ranges::any_of(summary.at("files"),
                               [&](const Json& file) { return file.at("name") == name; });
  });
}

// A file of no poses is no trajectory file for other readers.
Trajectory ReadPoses(const std::string& path) {
  if (ReadFile(path) == kTumHeader) return {};
  const Trajectory trajectory = CollectPoses(ReadPoseTable(path, {.stamps = "s"}), {}, {});
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const double farthest_m = trajectory[i].T_world_imu.translation.cwiseAbs().maxCoeff();
    if (farthest_m <= kMaxCoordinate_m) continue;
    throw DataError(fmt::format("{}: pose {}: found a coordinate of {} m, expected at most {}",
                                path, i + 1, farthest_m, kMaxCoordinate_m));
  }
  return trajectory;
}

std::vector<MapLine> ReadLines(const std::string& path) {
  const std::vector<MapLine> lines = ReadMapLines(path);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double farthest_m = std::max(lines[i].start_world.cwiseAbs().maxCoeff(),
                                       lines[i].end_world.cwiseAbs().maxCoeff());
    if (farthest_m <= kMaxCoordinate_m) continue;
    throw DataError(fmt::format("{}: edge row {}: found a coordinate of {} m, expected at most {}",
                                path, i + 1, farthest_m, kMaxCoordinate_m));
  }
  return lines;
}

void WritePoints(const std::string& path, const std::vector<MapPoint>& points) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "sigma_m"}) vertices.Add(name, PlyType::kFloat);
  for (const char* name : {"observations", "line_id"}) vertices.Add(name, PlyType::kInt32);
  for (const MapPoint& point : points) {
    vertices.AppendRow({point.p_world.x(), point.p_world.y(), point.p_world.z(), point.sigma_m,
                        static_cast<double>(point.observations),
                        static_cast<double>(point.line_id)});
  }
  WritePly(path, {{"slcmap points, metres in the world frame"}, {vertices}, {}});
}

std::vector<MapPoint> ReadPoints(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const auto coordinate = [&](const char* name) {
    return vertices.Bounded(name, -kMaxCoordinate_m, kMaxCoordinate_m, path);
  };
  const std::vector<double> x = coordinate("x"), y = coordinate("y"), z = coordinate("z");
  const std::vector<double>& sigma_m = vertices.Bounded("sigma_m", 0, kMaxSigma_m, path);
  const std::vector<double>& observations = vertices.Bounded("observations", 0, kMaxId, path);
  const std::vector<double>& line_ids = vertices.Bounded("line_id", -1, kMaxId, path);
  std::vector<MapPoint> points(vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = {{x[i], y[i], z[i]},
                 sigma_m[i],
                 static_cast<int>(observations[i]),
                 {},
                 static_cast<int64_t>(line_ids[i])};
  }
  return points;
}

void CheckLinesOfPoints(const std::string& path, const MapResult& map) {
  std::set<int64_t> known = {-1};
  for (const MapLine& line : map.lines) known.insert(line.id);
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    if (known.contains(map.points[i].line_id)) continue;
    throw DataError(fmt::format("{}: vertex row {}: found line_id {}, expected -1 or a line of {}",
                                path, i + 1, map.points[i].line_id, kLines));
  }
}

}  // namespace

StageFiles MapFiles() {
  StageFiles files{"a map", {kSummary}};
  for (const std::string& name : ListedNames(true, true, true)) files.names.push_back(name);
  return files;
}

std::string WriteMapFolder(const std::string& folder, const MapResult& map) {
  OutputFolder output(folder, MapFiles());
  return WriteMapFolder(&output, map);
}

std::string WriteMapFolder(OutputFolder* folder, const MapResult& map) {
  const std::string path = folder->staging() + "/";
  WriteTumTrajectory(path + kTrajectory, map.trajectory);
  WriteTumTrajectory(path + kKeyframes, map.keyframes);
  WritePoints(path + kPoints, map.points);
  WritePcd(path + kCloud, map.points);
  WritePointObservations(path + kPointObservationFile, map.point_observations);
  WriteDensePly(path + kDense, map);
  WriteDensePcd(path + kDenseCloud, map);
  WriteMapLines(path + kLines, map.lines);
  WriteMapLines(path + kMarks, map.marks);
  WriteLineEvidence(folder->staging(), map.line_evidence);
  WritePipes(path + kPipeFile, map.pipes);
  WritePatterns(path + kPatternFile, map.patterns);
  WriteBuilding(folder->staging(), map.building);
  WritePlaceIndex(path + kPlaceFile, MakePlaceIndex(map));
  map.occupancy.Write(path + kOccupancy);
  map.occupancy.WriteProbabilities(path + kProbabilities);
  WriteRig(path + kRig, map.rectified_rig);
  WriteFile(path + kOptions, map.source.options);
  if (map.plan) WritePlanComparison(folder->staging(), *map.plan);
  if (map.control) WriteControlFit(folder->staging(), *map.control, map.source.georeference);
  if (map.calibrated_rig) WriteKalibrCalibration(path + kCalibration, *map.calibrated_rig);
  const std::string id = WriteSummary(folder->staging(), map);
  folder->Commit(map.complete);
  std::error_code ignored;
  if (!map.calibrated_rig) {  // an earlier map's would be of another run
    std::filesystem::remove(folder->path() + "/" + kCalibration, ignored);
  }
  for (const char* name : kPlanComparisonFiles) {
    if (!map.plan) std::filesystem::remove(folder->path() + "/" + name, ignored);
  }
  for (const char* name : kControlFiles) {
    if (!map.control) std::filesystem::remove(folder->path() + "/" + name, ignored);
  }
  return id;
}

MapResult ReadMapFolder(const std::string& folder, const FolderReadOptions& options) {
  const InputLock lock(folder);
  const std::string path = folder + "/";
  MapResult map;
  const Json summary = ReadSummary(path + kSummary, &map);
  map.rectified_rig = ReadRig(path + kRig);
  map.trajectory = ReadPoses(path + kTrajectory);
  map.keyframes = ReadPoses(path + kKeyframes);
  CheckPosesOfRuns(path + kSummary, map);
  map.points = ReadPoints(path + kPoints);
  map.point_observations = ReadPointObservations(path + kPointObservationFile, map);
  ReadDensePly(path + kDense, &map);
  map.lines = ReadLines(path + kLines);
  map.marks = ReadLines(path + kMarks);
  CheckLinesOfPoints(path + kPoints, map);
  map.line_evidence = ReadLineEvidence(folder, map);
  map.pipes = ReadPipes(path + kPipeFile);
  map.patterns = ReadPatterns(path + kPatternFile);
  map.building = ReadBuilding(folder);
  ReadSeenShare(path + kSummary, summary, &map);
  if (HasFile(folder, summary, kPlanComparisonFiles[0])) map.plan = ReadPlanComparison(folder);
  if (HasFile(folder, summary, kControlFiles[0])) map.control = ReadControlFit(folder);
  map.occupancy = OccupancyMap::Read(path + kOccupancy);
  map.source.options = ReadFile(path + kOptions);
  if (options.accept_changed) return map;
  WithJsonErrors(path + kSummary, [&] {
    CheckCounts(folder, summary, map);
    CheckFiles(folder, kSummary, summary);
  });
  return map;
}

MapSource MapSourceIn(const std::string& folder) {
  MapResult map;
  ReadSummary(folder + "/" + kSummary, &map);
  return map.source;
}

}  // namespace slcmap::mapping
