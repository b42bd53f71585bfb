#include "apps/map_input.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "apps/commands.h"
#include "data/error.h"
#include "data/file.h"
#include "mapping/map_folder.h"
#include "mapping/merge/merge_maps.h"
#include "odometry/run_folder.h"

namespace slcmap {
namespace {

// As `slcmap run` lays folders out, the run of a map is beside it.
void RefuseOutdated(const std::string& folder, const MapResult& map) {
  const std::filesystem::path self = FolderItself(folder);
  if (self.filename() != "map") return;  // not laid out as `run` does it
  const std::string run = self.parent_path() / "run";
  const std::string found = RunIdIn(run);
  const std::vector<std::string> runs = RunsOf(map);
  if (found.empty() || std::find(runs.begin(), runs.end(), found) != runs.end()) return;
  throw DataError(
      fmt::format("{}: found a map of run {}, expected one of run {}, which is in {}: map that run "
                  "first, or take the map as it is with --accept-changed",
                  folder, map.source.run_id, found, run));
}

MapResult Read(const std::string& folder, bool accept_changed) {
  const EndsAtOnce nothing_is_written;
  return ReadAccepting(accept_changed, [&](bool accept) {
    MapResult map = ReadMapFolder(folder, {.accept_changed = accept});
    if (!accept) RefuseOutdated(folder, map);
    return map;
  });
}

}  // namespace

MapResult ReadMapToShow(const std::string& folder, bool accept_changed) {
  MapResult map = Read(folder, accept_changed);
  if (!map.complete) spdlog::warn("{}: the map is partial: {}", folder, map.partial_reason);
  return map;
}

}  // namespace slcmap
