#include "apps/map_stage.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "apps/commands.h"
#include "apps/map_input.h"
#include "apps/merge_stage.h"
#include "apps/progress.h"
#include "data/calibration.h"
#include "data/trajectory.h"
#include "data/warnings.h"
#include "mapping/adjustment/adjusted_run.h"
#include "mapping/given_poses/given_poses.h"
#include "mapping/map_folder.h"
#include "mapping/mapping.h"
#include "mapping/merge/merge_maps.h"
#include "mapping/views/recorded_views.h"
#include "odometry/method.h"
#include "odometry/run_folder.h"
#include "odometry/verdict/judge.h"

namespace slcmap {
namespace {

constexpr double kAdjusted = 0.1;  // share of the time, about

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

OdometryRun ReadRun(const MapArguments& arguments) {
  const EndsAtOnce nothing_is_written;
  if (!arguments.poses.empty()) {
    return RunAtPoses(arguments.input, arguments.calibration, ReadTrajectory(arguments.poses));
  }
  OdometryRun run = ReadRunFolder(arguments.input, {.accept_changed = arguments.accept_changed});
  // Cut off, or of an earlier version.
  if (!run.verdict) run.verdict = JudgeRun(run, VerdictOptions());
  return run;
}

// The images of the run's keyframes; nothing where the map is made without them.
std::optional<RecordedViews> OpenViews(const MapArguments& arguments, const OdometryRun& run) {
  if (arguments.sparse || run.keyframes.empty()) return std::nullopt;
  const char* reason = !run.source                      ? "that does not say where its images are"
                       : !IsStereo(run.source->raw_rig) ? "of one camera"
                                                        : nullptr;
  if (reason) {
    spdlog::warn("{}: a run {} is mapped from its landmarks alone", arguments.input, reason);
    return std::nullopt;
  }
  return ViewsOfRun(run, arguments.sequence);
}

// Where revisits are looked for in them: the images of the keyframes with the calibration that
// odometry found, which is good enough to recognise a place; else none.
std::unique_ptr<ViewImages> ImagesOfRevisits(const MapArguments& arguments,
                                             const AdjustmentOptions& options,
                                             const OdometryRun& run) {
  const bool are_wanted = options.enabled && options.closures.enabled && options.closures.points;
  if (!are_wanted || arguments.sparse || run.method == kGivenPoses || run.keyframes.empty() ||
      !run.source || !IsStereo(run.source->raw_rig)) {
    return nullptr;
  }
  return KeyframeImages(run, arguments.sequence);
}

// Of a run whose poses were given.
std::optional<GivenPoseFigures> AdjustGiven(const MapArguments& arguments,
                                            const GivenPoseOptions& options, OdometryRun* run,
                                            const Progress& progress) {
  const bool has_images = run->source && IsStereo(run->source->raw_rig) && !run->keyframes.empty();
  if (!options.adjust || arguments.sparse || run->method != kGivenPoses || !has_images) {
    return std::nullopt;
  }
  const auto images = KeyframeImages(*run, arguments.sequence);
  return AdjustGivenPoses(*images, options, run, progress);
}

// The map that the run's is merged into; nothing where there is none.
std::optional<MapResult> OtherMap(const MapArguments& arguments, const OdometryRun& run) {
  if (arguments.into.empty()) return std::nullopt;
  MapResult other = ReadMapToShow(arguments.into, arguments.accept_changed);
  const std::vector<std::string> runs = RunsOf(other);
  if (run.id.empty() || std::find(runs.begin(), runs.end(), run.id) == runs.end()) return other;
  throw DataError(fmt::format("{}: found run {} in the map already, expected one without it",
                              arguments.into, run.id));
}

MapResult MergedInto(MapResult other, MapResult map, const MapArguments& arguments) {
  if (Interrupted()) throw StoppedError("interrupted");
  return MergeStage(std::move(other), std::move(map), arguments.input, arguments.at,
                    OptionsOfMerging(arguments.config, arguments.into), StageProgress("merge"));
}

}  // namespace

MappingOptions ReadMappingOptions(const std::string& config) {
  return config.empty() ? MappingOptions() : MappingOptions::FromYaml(config);
}

MapResult RunMapStage(const MapArguments& arguments, const MappingOptions& options,
                      OutputFolder* output) {
  OdometryRun run = ReadRun(arguments);
  spdlog::debug("{}: {} poses, {} keyframes, {} landmarks, {} lines", arguments.input,
                run.states.size(), run.keyframes.size(), run.landmarks.size(), run.lines.size());
  WarnOfRun(arguments.input, run);
  std::optional<MapResult> other = OtherMap(arguments, run);
  const Progress progress = StageProgress("map");
  const auto given = AdjustGiven(arguments, options.given_poses, &run, progress.Part(0, kAdjusted));
  const auto images = ImagesOfRevisits(arguments, options.adjustment, run);
  const AdjustedRun adjusted =
      AdjustRun(std::move(run), options.adjustment, images.get(), progress.Part(0, kAdjusted));
  // Images are rectified with the calibration that the adjustment found.
  const std::optional<RecordedViews> recorded = OpenViews(arguments, adjusted.run);
  MapResult map =
      BuildMap(adjusted.run, recorded ? &*recorded : nullptr, options, progress.Part(kAdjusted, 1));
  map.adjustment = adjusted.figures;
  map.given_poses = given;
  if (other) map = MergedInto(std::move(*other), std::move(map), arguments);
  map.id = WriteMapFolder(output, map);
  spdlog::info(
      "wrote {}: {} poses, {} points of {} landmarks, {} lines, {} occupied voxels of {} m",
      output->path(), map.trajectory.size(), map.points.size(), adjusted.run.landmarks.size(),
      map.lines.size(), map.occupancy.OccupiedVoxels().size(), map.occupancy.resolution_m());
  if (Interrupted() && !map.complete) {
    spdlog::warn("{}: the map is partial: {}", output->path(), map.partial_reason);
  }
  return map;
}

}  // namespace slcmap
