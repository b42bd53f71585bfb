#include "apps/map_world.h"

#include <filesystem>

#include "mapping/map_folder.h"
#include "odometry/run_folder.h"

namespace slcmap {
namespace {

std::string FolderOf(const std::string& file) {
  const std::string folder = std::filesystem::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace

RigidTransform TrajectoryFromMap(const std::string& trajectory, const std::string& mapped_file) {
  const std::string run_id = RunIdIn(FolderOf(trajectory));
  if (run_id.empty()) return {};
  const MapSource source = MapSourceIn(FolderOf(mapped_file));
  return source.run_id == run_id ? source.T_world_run.Inverse() : RigidTransform();
}

}  // namespace slcmap
