#include "apps/map_world.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <map>
#include <optional>

#include "data/error.h"
#include "export/export.h"
#include "mapping/map_folder.h"
#include "odometry/run_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

using WorldsOfRuns = std::map<std::string, RigidTransform>;  // T_world_run by the run's id

std::string FolderOf(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool Has(const std::string& folder, const char* name) {
  std::error_code error;
  return fs::exists(fs::path(folder) / name, error);
}

WorldsOfRuns WorldsOf(const MapSource& source) {
  WorldsOfRuns worlds = {{source.run_id, source.T_world_run}};
  for (const MergedRun& run : source.merged) worlds[run.run_id] = run.T_world_run;
  return worlds;
}

// How the runs that a folder's files are of lie in the world of these; none of a folder of another
// kind. A file of that name may be of another program.
WorldsOfRuns WorldsIn(const std::string& folder) {
  try {
    if (Has(folder, "run.json")) return {{RunIdIn(folder), {}}};
    if (Has(folder, "map.json")) return WorldsOf(MapSourceIn(folder));
    if (Has(folder, "export.json")) return WorldsOf(ExportSourceIn(folder));
  } catch (const DataError& error) {
    spdlog::warn("{}; of which world the files beside it are is not known", error.what());
  }
  return {};
}

bool IsTurned(const RigidTransform& T) {
  constexpr double kLeast_rad = 1e-9;
  return LogRotation(T.rotation).norm() > kLeast_rad;
}

// How far a map that a file lies in is from where its poses were given.
Eigen::Vector3d OffsetIn(const std::string& folder) {
  try {
    if (Has(folder, "map.json")) return MapSourceIn(folder).world_offset_m;
  } catch (const DataError&) {  // WorldsIn says it
  }
  return Eigen::Vector3d::Zero();
}

RigidTransform TurnFromFile(const std::string& trajectory, const std::string& mapped_file) {
  const WorldsOfRuns mapped = WorldsIn(FolderOf(mapped_file)),
                     given = WorldsIn(FolderOf(trajectory));
  for (const auto& [run_id, T_mapped_run] : mapped) {
    if (run_id.empty()) continue;  // of any run that was killed
    const auto found = given.find(run_id);
    if (found != given.end()) return found->second * T_mapped_run.Inverse();
  }
  for (const auto& [run_id, T_mapped_run] : mapped) {
    if (!IsTurned(T_mapped_run)) continue;
    spdlog::warn(
        "{}: found a map that is turned by {:.2f} degrees against its run, expected a trajectory "
        "of "
        "it or of its run, where its stage wrote it; {} is taken to be in the map's world",
        mapped_file, LogRotation(T_mapped_run.rotation).norm() * 180 / M_PI, trajectory);
    break;
  }
  return {};
}

RigidTransform TrajectoryFromFile(const std::string& trajectory, const std::string& mapped_file) {
  RigidTransform T = TurnFromFile(trajectory, mapped_file);
  T.translation += OffsetIn(FolderOf(mapped_file)) - OffsetIn(FolderOf(trajectory));
  return T;
}

}  // namespace

RigidTransform TrajectoryFromMap(const std::string& trajectory,
                                 const std::vector<std::string>& mapped_files) {
  std::optional<RigidTransform> common;
  for (const std::string& file : mapped_files) {
    if (file.empty()) continue;
    const RigidTransform T = TrajectoryFromFile(trajectory, file);
    if (common && IsTurned(common->Inverse() * T)) {
      throw ConfigError(file + ": found it in another world than " + mapped_files.front() +
                        ", expected both of one map");
    }
    common = T;
  }
  return common.value_or(RigidTransform());
}

}  // namespace slcmap
