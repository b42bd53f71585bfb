#include "apps/map_stage.h"

#include <spdlog/spdlog.h>

#include "apps/commands.h"
#include "apps/progress.h"
#include "data/warnings.h"
#include "mapping/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/run_folder.h"
#include "odometry/verdict/judge.h"

namespace slcmap {
namespace {

// How often poses go on in another segment, which starts at the last pose of the one before.
int SegmentEnds(const OdometryRun& run) {
  int ends = 0;
  for (size_t i = 1; i < run.states.size(); ++i) {
    ends += run.states[i].segment != run.states[i - 1].segment;
  }
  return ends;
}

// Counted warnings are what tells why there are none.
void WarnOfNoPoses(const std::string& folder, const OdometryRun& run) {
  std::string reasons;
  for (const auto& [kind, count] : run.warnings) {
    reasons += fmt::format("; {}: {}", Warnings::InWords(kind), count);
  }
  spdlog::warn("{}: found no pose in the run, so the map is empty{}", folder, reasons);
}

void WarnOfRun(const std::string& folder, const OdometryRun& run) {
  if (!run.complete) spdlog::warn("{}: the run is partial: {}", folder, run.partial_reason);
  if (run.states.empty()) WarnOfNoPoses(folder, run);
  if (const int ends = SegmentEnds(run); ends > 0) {
    spdlog::warn(
        "{}: the estimator lost itself {} times; the map behind each is shifted by what "
        "moved meanwhile",
        folder, ends);
  }
}

OdometryRun ReadRun(const std::string& folder, bool accept_changed) {
  const EndsAtOnce nothing_is_written;
  return ReadRunFolder(folder, {.accept_changed = accept_changed});
}

}  // namespace

MappingOptions ReadMappingOptions(const std::string& config) {
  return config.empty() ? MappingOptions() : MappingOptions::FromYaml(config);
}

MapResult RunMapStage(const std::string& run_folder, const MappingOptions& options,
                      bool accept_changed, OutputFolder* output) {
  OdometryRun run = ReadRun(run_folder, accept_changed);
  if (!run.verdict)
    run.verdict = JudgeRun(run, VerdictOptions());  // cut off, or of an earlier version
  spdlog::debug("{}: {} poses, {} keyframes, {} landmarks, {} lines", run_folder, run.states.size(),
                run.keyframes.size(), run.landmarks.size(), run.lines.size());
  WarnOfRun(run_folder, run);
  MapResult map = BuildMap(run, options, StageProgress("map"));
  map.id = WriteMapFolder(output, map);
  spdlog::info(
      "wrote {}: {} poses, {} points of {} landmarks, {} of {} lines, {} occupied voxels of "
      "{} m",
      output->path(), map.trajectory.size(), map.points.size(), run.landmarks.size(),
      map.lines.size(), run.lines.size(), map.occupancy.OccupiedVoxels().size(),
      map.occupancy.resolution_m());
  if (Interrupted() && !map.complete) {
    spdlog::warn("{}: the map is partial: {}", output->path(), map.partial_reason);
  }
  return map;
}

}  // namespace slcmap
