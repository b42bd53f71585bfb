#include "export/export.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "data/core/error.h"
#include "data/io/json.h"
#include "data/io/yaml.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline exporting {
namespace {

namespace fs = std::filesystem;

constexpr char kSummary[] = "export.json";
constexpr int kExportVersion = 1;

void WriteSummary(const std::string& folder, const MapResult& map,
                  const RigidTransform& T_export_map, const std::vector<std::string>& names) {
  Json json = {{"format", "slcmap export"},
               {"version", kExportVersion},
               {"map", map.id},
               {"run", map.source.run_id},
               {"yaw_rad", YawOfWorld(map.source.T_world_run)},
               {"georeference", GeoreferenceJson(map.source.georeference)},
               {"map_yaw_rad", YawOfWorld(T_export_map)},
               {"complete", map.complete},
               {"partial_reason", map.partial_reason}};
  if (!map.source.merged.empty()) json["merged"] = MergedJson(map.source.merged);
  json["files"] = ListFiles(folder, names);
  WriteSummaryFile(folder + "/" + kSummary, json);
}

// The files that an earlier export in the folder says it wrote; none where there is none.
std::set<std::string> FilesOfLastExport(const std::string& folder) {
  const std::string path = folder + "/" + kSummary;
  std::error_code error;
  if (!fs::exists(path, error)) return {};
  return ParseJsonFile(path, [](const Json& json) {
    std::set<std::string> names;
    for (const Json& file : json.at("files")) names.insert(file.at("name").get<std::string>());
    return names;
  });
}

// Folders are replaced with all that they hold, which must be what an export wrote.
void RefuseFilesOfOthers(const std::string& folder, const std::set<std::string>& last,
                         const std::vector<MapFormat>& formats) {
  for (const MapFormat& format : formats) {
    for (const std::string& name : format.files) {
      std::error_code error;
      if (!fs::is_directory(folder + "/" + name, error)) continue;
      for (const auto& entry : fs::recursive_directory_iterator(folder + "/" + name, error)) {
        const std::string found = fs::path(entry.path()).lexically_relative(folder).string();
        if (entry.is_directory() || last.contains(found)) continue;
        throw ConfigError(fmt::format(
            "output {}: found {}, which no export wrote, expected a folder without other files: it "
            "would be removed",
            folder, found));
      }
    }
  }
}

// What an earlier export left in formats that this one does not have would be of another map.
void RemoveOthers(const std::string& folder, const std::set<std::string>& last,
                  const std::vector<std::string>& names) {
  std::error_code error;
  for (const std::string& name : last) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const fs::path path = fs::path(folder) / name;
    fs::remove(path, error);
    if (path.parent_path() != fs::path(folder)) fs::remove(path.parent_path(), error);  // if empty
  }
}

// The formats there are, with their options.
std::vector<MapFormat> ListFormats(const ExportOptions& options) {
  using std::bind_front;
  const auto scene = std::make_shared<SceneOfMap>(options.max_vertices);
  const auto textures = std::make_shared<std::vector<FaceTexture>>();
  return {// First, as the scene shows its images.
          {"ortho", {"ortho"}, bind_front(WriteOrtho, options.recording, textures), false},
          {"glb",
           {"scene.glb"},
           bind_front(WriteGlb, options.gltf, options.max_vertices, scene, textures)},
          {"ply",
           {"points.ply", "lines.ply", "trajectory.ply", "keyframes.ply", "voxels.ply",
            "line_bars.ply"},
           bind_front(WriteScenePly, options.ascii_ply, scene)},
          {"cloud",
           {"points.pcd", "dense.pcd", "dense.ply", "occupancy.bt"},
           bind_front(WriteClouds, options.ascii_ply)},
          {"svg", {"plan"}, bind_front(WriteSvgPlans, options.plan)},
          {"pdf", {"plan.pdf", "plan"}, bind_front(WritePdfPlans, options.plan)},
          {"dxf", {"plan.dxf", "map.dxf", "plan"}, bind_front(WriteDxf, options.plan)},
          {"obj", {"map.obj", "map.mtl"}, bind_front(WriteObj, options.obj_up)},
          {"ifc", {"map.ifc"}, bind_front(WriteIfc, options.ifc_line_solids)},
          {"colmap", {"colmap"}, bind_front(WriteColmap, options.colmap_images, options.recording)},
          {"limap", {"limap"}, WriteLimap},
          {"grid", {"grid"}, bind_front(WriteGrids, options.grid)},
          {"las", {"cloud.las"}, bind_front(WriteLas, options.las_version)},
          {"e57", {"cloud.e57"}, WriteE57},
          {"gpkg", {"plan.gpkg"}, WriteGeoPackage},
          {"geojson", {"plan"}, WriteGeoJson},
          {"tiles", {"tiles"}, bind_front(WriteTiles, options.tiles_page)}};
}

// Those that are wanted.
std::vector<MapFormat> WantedFormats(const ExportOptions& options) {
  std::vector<MapFormat> formats = ListFormats(options);
  std::erase_if(formats, [&](const MapFormat& format) {
    if (options.formats.empty()) return !format.is_written_by_default;
    return std::ranges::count(options.formats, format.name) == 0;
  });
  return formats;
}

// What readers of the files would not find out from them.
void TellOfFiles(const MapResult& map, const std::vector<MapFormat>& formats) {
  const auto has = [&](const std::set<std::string>& names) {
    return std::ranges::any_of(
        formats, [&](const MapFormat& format) { return names.contains(format.name); });
  };
  const bool has_surroundings = !map.building.storeys.empty() || CountDense(map) > 0;
  if (has_surroundings && map.building.walls.empty() && has({"svg", "pdf", "dxf"})) {
    spdlog::warn("plans: no wall was found in this map, plans show none");
  }
  if (map.source.georeference && has({"limap", "cloud"})) {
    spdlog::info(
        "limap's files, .pcd and .bt cannot hold where the map lies, which export.json says: {}",
        GeoreferenceNote(map.source.georeference));
  }
}

// Those that nobody opens by themselves.
bool IsOneOfMany(const std::string& name) {
  return name.starts_with("colmap/images/") || name.starts_with("ortho/wall_") ||
         (name.starts_with("tiles/") && !name.ends_with("tileset.json"));
}

// Files of a map that is in the frame of exports, which T_export_map turned it to.
std::vector<std::string> WriteFormats(const MapResult& map, const RigidTransform& T_export_map,
                                      const ExportOptions& options, const Progress& progress,
                                      OutputFolder* folder) {
  const std::vector<MapFormat> formats = WantedFormats(options);
  TellOfFiles(map, formats);
  const std::set<std::string> last = FilesOfLastExport(folder->path());
  RefuseFilesOfOthers(folder->path(), last, formats);
  const auto parts = static_cast<double>(formats.size());
  std::vector<std::string> names;
  for (std::size_t i = 0; i < formats.size(); ++i) {
    const double from = static_cast<double>(i) / parts;
    const Progress part = progress.Part(from, from + 1 / parts);
    part.ReportOrStop(0);
    for (const std::string& path : formats[i].write(folder->staging(), map, part)) {
      names.push_back(path.substr(folder->staging().size() + 1));
    }
  }
  progress.ReportOrStop(1);
  WriteSummary(folder->staging(), map, T_export_map, names);
  folder->Commit(map.complete);
  RemoveOthers(folder->path(), last, names);
  std::vector<std::string> paths;
  for (const std::string& name : names) {
    if (!IsOneOfMany(name)) paths.push_back(folder->path() + "/" + name);
  }
  return paths;
}

}  // namespace

std::vector<std::string> ExportFormats() {
  std::vector<MapFormat> formats = ListFormats({});
  std::ranges::stable_partition(formats, &MapFormat::is_written_by_default);
  std::vector<std::string> names;
  for (const MapFormat& format : formats) names.push_back(format.name);
  return names;
}

StageFiles ExportFiles() {
  StageFiles files = {"an export", {kSummary}};
  for (const MapFormat& format : ListFormats({})) {
    for (const std::string& name : format.files) {
      if (std::ranges::find(files.names, name) == files.names.end()) files.names.push_back(name);
    }
  }
  return files;
}

MapSource ExportSourceIn(const std::string& folder) {
  const std::string path = folder + "/" + kSummary;
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, "slcmap export", kExportVersion, kExportVersion);
    MapSource source;
    source.run_id = json.at("run").get<std::string>();
    // Missing in exports of earlier versions.
    if (json.contains("yaw_rad")) source.T_world_run = ParseTurn(path, json);
    source.georeference = ParseGeoreference(path, json);
    if (json.contains("merged")) source.merged = ParseMerged(path, json.at("merged"), source);
    return source;
  });
}

void CheckFormats(const ExportOptions& options) {
  const auto refuse_unless = [](bool is_good, const char* key, const std::string& found,
                                const char* expected) {
    if (is_good) return;
    throw ConfigError(fmt::format("{}: found {}, expected {}", key, found, expected));
  };
  const auto expect_one = [&](const std::string& value, const std::vector<std::string>& known,
                              const char* key, const char* expected) {
    refuse_unless(std::ranges::count(known, value) > 0, key, "'" + value + "'", expected);
  };
  options.plan.Check();
  expect_one(options.obj_up, {"z", "y"}, "obj up", "'z' or 'y'");
  expect_one(options.colmap_images, {"", "rectified"}, "colmap images", "'rectified'");
  const auto& [low_m, high_m] = options.grid;
  refuse_unless(std::isfinite(low_m) && std::isfinite(high_m) && low_m < high_m, "grid heights",
                fmt::format("{} to {}", low_m, high_m),
                "a lower and a higher one, in metres over the floor");
  expect_one(options.las_version, {"1.2", "1.4"}, "las version", "1.2 or 1.4");
  const std::vector<std::string> known = ExportFormats();
  for (const std::string& format : options.formats) {
    if (std::find(known.begin(), known.end(), format) != known.end()) continue;
    throw ConfigError(fmt::format("format: found '{}', expected one of {}{}", format,
                                  fmt::join(known, ", "), DidYouMean(format, known)));
  }
  const bool reads_images = !options.colmap_images.empty() ||
                            std::ranges::find(options.formats, "ortho") != options.formats.end();
  if (!options.recording.sequence.empty() && !reads_images) {
    throw ConfigError(
        "sequence: found no format that needs the recording, expected --format ortho or "
        "--colmap-images");
  }
  const bool has_sections = !options.plan.sections.empty() || !options.plan.elevations.empty();
  const auto draws = [](const std::string& format) {
    return format == "svg" || format == "pdf" || format == "dxf";
  };
  if (has_sections && !options.formats.empty() && std::ranges::none_of(options.formats, draws)) {
    throw ConfigError(
        fmt::format("format: found {}, expected svg, pdf or dxf too, which sections and elevations "
                    "are drawn in",
                    fmt::join(options.formats, ", ")));
  }
}

std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options, const Progress& progress) {
  CheckFormats(options);
  OutputFolder output(folder, ExportFiles());
  return ExportMap(map, &output, options, progress);
}

std::vector<std::string> ExportMap(const MapResult& map, OutputFolder* folder,
                                   const ExportOptions& options, const Progress& progress) {
  CheckFormats(options);
  const RigidTransform T_export_map = FrameOfExports(map);
  if (IsInFrameOfExports(map.building)) {
    return WriteFormats(map, T_export_map, options, progress, folder);
  }
  const MapResult turned = InFrameOfExports(map, progress.Part(0, 0.1));
  return WriteFormats(turned, T_export_map, options, progress.Part(0.1, 1), folder);
}

namespace {

using Eigen::Vector3d;

void TurnPoint(const RigidTransform& T, Vector3d* p) { *p = T * *p; }

void TurnPoints(const RigidTransform& T, std::vector<Vector3d>* points) {
  for (Vector3d& p : *points) p = T * p;
}

void TurnPlanPoints(const RigidTransform& T, PlanPoints* points) {
  for (Eigen::Vector2d& p : *points) p = (T * Vector3d(p.x(), p.y(), 0)).head<2>();
}

void TurnBuilding(const RigidTransform& T, Building* building) {
  for (BuildingPlane& plane : building->planes) {
    plane.normal = T.rotation * plane.normal;
    TurnPoints(T, &plane.outline_world);
    for (PlaneOpening& opening : plane.openings) TurnPoints(T, &opening.outline_world);
  }
  for (Room& room : building->rooms) {
    TurnPlanPoints(T, &room.polygon.outline);
    for (PlanPoints& hole : room.polygon.holes) TurnPlanPoints(T, &hole);
  }
  for (PlanWall& wall : building->walls) {
    PlanPoints ends = {wall.start, wall.end};
    TurnPlanPoints(T, &ends);
    wall.start = ends[0];
    wall.end = ends[1];
  }
  building->T_map_world = {};
}

void TurnLines(const RigidTransform& T, MapResult* map) {
  for (auto* lines : {&map->lines, &map->marks}) {
    for (MapLine& line : *lines) {
      TurnPoint(T, &line.start_world);
      TurnPoint(T, &line.end_world);
    }
  }
  for (MapPipe& pipe : map->pipes) {
    TurnPoint(T, &pipe.start_world);
    TurnPoint(T, &pipe.end_world);
  }
  for (MapPattern& pattern : map->patterns) {
    TurnPoint(T, &pattern.origin_world);
    for (auto* way : {&pattern.direction_world, &pattern.across_world}) *way = T.rotation * *way;
  }
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (LineCovariance& covariance : map->line_evidence.covariances) {
    for (auto* m : {&covariance.start_m2, &covariance.end_m2, &covariance.start_end_m2}) {
      *m = R * *m * R.transpose();
    }
  }
}

void TurnContent(const RigidTransform& T, MapResult* map) {
  map->source.T_world_run = T * map->source.T_world_run;
  for (MergedRun& run : map->source.merged) run.T_world_run = T * run.T_world_run;
  for (Trajectory* poses : {&map->trajectory, &map->keyframes}) {
    for (StampedPose& pose : *poses) pose.T_world_imu = T * pose.T_world_imu;
  }
  for (MapPoint& point : map->points) TurnPoint(T, &point.p_world);
  for (std::vector<DensePoint>* points : {&map->dense, &map->filled}) {
    for (DensePoint& point : *points) {
      TurnPoint(T, &point.p_world);
      point.normal_world = T.rotation * point.normal_world;
    }
  }
  TurnLines(T, map);
  TurnBuilding(T, &map->building);
  map->source.georeference = MoveGeoreference(map->source.georeference, T);
  if (map->plan) map->plan->T_plan_world = map->plan->T_plan_world * T.Inverse();
}

// The cells whose centres are in a voxel that was turned.
void AddCells(const Voxel& voxel, const RigidTransform& T, double resolution_m,
              std::vector<OctreeCell>* cells) {
  const RigidTransform T_back = T.Inverse();
  const double half_m = 0.5 * voxel.size_m;
  const double turn_rad = 2 * std::atan2(T.rotation.z(), T.rotation.w());
  const double reach_m = half_m * (std::abs(std::cos(turn_rad)) + std::abs(std::sin(turn_rad)));
  const Vector3d centre = T * voxel.centre_world;
  const Vector3d reach(reach_m, reach_m, half_m);
  const Vector3d low = (centre - reach) / resolution_m, high = (centre + reach) / resolution_m;
  for (int x = static_cast<int>(std::floor(low.x())); x <= high.x(); ++x) {
    for (int y = static_cast<int>(std::floor(low.y())); y <= high.y(); ++y) {
      const Vector3d p = T_back * Vector3d(resolution_m * (x + 0.5), resolution_m * (y + 0.5), 0);
      const Eigen::Array2d off = (p - voxel.centre_world).head<2>().array();
      if (!((off >= -half_m) && (off < half_m)).all()) continue;
      const int from = static_cast<int>(std::lround(low.z()));
      const int to = static_cast<int>(std::lround(high.z()));
      for (int z = from; z < to; ++z) cells->emplace_back(x, y, z);
    }
  }
}

OccupancyMap TurnedOccupancy(const OccupancyMap& occupancy, const RigidTransform& T,
                             const Progress& progress) {
  OccupancyMap turned(occupancy.resolution_m());
  for (const bool occupied : {false, true}) {
    const std::vector<Voxel> voxels =
        occupied ? occupancy.OccupiedVoxels() : occupancy.FreeVoxels();
    CellObservation cells;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      std::vector<OctreeCell>& kind = occupied ? cells.occupied : cells.free;
      AddCells(voxels[i], T, turned.resolution_m(), &kind);
      if (kind.size() < 100000 && i + 1 < voxels.size()) continue;
      progress.ReportOrStop(0);
      turned.Mark(cells);
      kind.clear();
    }
  }
  turned.Finish();
  return turned;
}

// All but the occupancy, which is not copied. The names of all members stand here, so that the
// compiler says where one is missing.
MapResult CopyMap(const MapResult& map) {
  const auto& [id, source, method, complete, partial_reason, interrupted, warnings, verdict,
               rectified_rig, adjustment, given_poses, calibrated_rig, trajectory, keyframes,
               points, point_observations, dense, filled, lines, marks, patterns, line_evidence,
               pipes, building, seen_share, control, plan, occupancy] = map;
  return {id,
          source,
          method,
          complete,
          partial_reason,
          interrupted,
          warnings,
          verdict,
          rectified_rig,
          adjustment,
          given_poses,
          calibrated_rig,
          trajectory,
          keyframes,
          points,
          point_observations,
          dense,
          filled,
          lines,
          marks,
          patterns,
          line_evidence,
          pipes,
          building,
          seen_share,
          control,
          plan,
          OccupancyMap(occupancy.resolution_m())};
}

}  // namespace

RigidTransform FrameOfExports(const MapResult& map) {
  if (IsShiftedOnly(map.source.georeference)) return {};
  const double turn_rad = YawOfWorld(map.building.T_map_world);
  return {ExpRotation({0, 0, std::remainder(turn_rad, 0.5 * M_PI)}), Vector3d::Zero()};
}

bool IsInFrameOfExports(const Building& building) {
  return LogRotation(building.T_map_world.rotation).isZero(0) &&
         building.T_map_world.translation.isZero(0);
}

MapResult InFrameOfExports(const MapResult& map, const Progress& progress) {
  const RigidTransform T = FrameOfExports(map);
  MapResult turned = CopyMap(map);
  TurnContent(T, &turned);
  turned.occupancy = TurnedOccupancy(map.occupancy, T, progress);
  return turned;
}

}  // namespace slcmap::exporting
