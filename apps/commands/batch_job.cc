// The jobs of a site, as the workflow's engine starts them: each is this program again.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <thread>

#include "apps/batch/workflow.h"
#include "apps/commands/child_process.h"
#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "apps/commands/place_stage.h"
#include "apps/commands/progress.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/core/error.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/io/trajectory.h"
#include "mapping/map/control_fit.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/names.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

struct SiteJob {
  const std::string folder;  // of the site
  const Workflow& workflow;
  const Job& job;
  const int threads;

  // As the jobs are started in the site's folder, paths in what they write do not name that.
  std::string InSite(const std::string& path) const {
    return folder == "." ? path : folder + "/" + path;
  }
  std::string Own(const std::string& name) const { return InSite(job.name + "/" + name); }
};

// How a step of a job ended that did not succeed.
struct StepFailure {
  std::string reason, remedy;
  int exit_code = 0;
};

// As the program says errors: "slcmap: error: WORDS; remedy: WORDS".
StepFailure FailureInWords(std::string words, const std::string& log, int exit_code) {
  constexpr std::string_view kError = "slcmap: error: ", kRemedy = "; remedy: ";
  if (words.starts_with(kError)) words.erase(0, kError.size());
  const std::size_t remedy = words.find(kRemedy);
  if (remedy == words.npos) return {words, "see " + log, exit_code};
  return {words.substr(0, remedy), words.substr(remedy + kRemedy.size()), exit_code};
}

// Runs a command of this program, its words in a log beside what the job makes. Nothing where it
// succeeded.
std::optional<StepFailure> RunStep(const SiteJob& job, const std::string& name,
                                   const std::vector<std::string>& arguments) {
  const std::string log = job.Own(name + ".log");
  spdlog::info("{}: {}", job.job.name, name);
  const int code = RunSelf(arguments, log);
  if (Interrupted()) throw StoppedError("interrupted; run the site again to go on");
  if (code == kExitSuccess) return std::nullopt;
  if (code >= kExitSignal) {
    const std::string remedy = code - kExitSignal == SIGKILL ? "give it more memory; " : "";
    return StepFailure{fmt::format("{} was ended by signal {}", name, code - kExitSignal),
                       remedy + "see " + log, code};
  }
  return FailureInWords(LastLine(log), log, code);
}

JobResult FailedResult(const StepFailure& failure) {
  JobResult result;
  result.reason = failure.reason;
  result.remedy = failure.remedy;
  return result;
}

std::vector<std::string> WithConfig(const SiteJob& job, std::vector<std::string> arguments) {
  const std::string& config = job.workflow.site.config;
  if (!config.empty()) arguments.insert(arguments.end(), {"--config", job.InSite(config)});
  arguments.insert(arguments.end(), {"--threads", std::to_string(job.threads)});
  return arguments;
}

std::vector<std::string> OdometryCommand(const SiteJob& job, const SiteRecording& recording) {
  std::vector<std::string> command = {"odometry", recording.path, "-o", job.Own("run")};
  const std::vector<std::string> opened = SequenceArguments(recording.opened);
  command.insert(command.end(), opened.begin(), opened.end());
  const std::string& method = job.workflow.site.method;
  if (!method.empty()) command.insert(command.end(), {"--method", method});
  return WithConfig(job, command);
}

// What a run says of itself.
void TakeVerdict(const std::string& run, JobResult* result) {
  const std::string path = run + "/run.json";
  const std::optional<Verdict> verdict =
      ParseJsonFile(path, [&](const Json& json) { return ParseVerdict(path, json); });
  if (!verdict) return;
  result->verdict = VerdictLevelName(verdict->level);
  if (verdict->level != VerdictLevel::kFailed) {
    result->length_m = MeasurePathLength_m(ReadTrajectory(run + "/trajectory.tum"));
  }
  if (verdict->level == VerdictLevel::kGood || verdict->reasons.empty()) return;
  const VerdictReason& worst = verdict->reasons.front();
  result->reason =
      fmt::format("{}: found {}, expected {}", worst.what, worst.found, worst.expected);
  result->remedy = worst.remedy;
}

// The run of a recording, unless a job that was killed while it made the map has left it.
std::optional<StepFailure> MakeSiteRun(const SiteJob& job, JobResult* result) {
  const std::string run = job.Own("run");
  const auto before = ReadJobResult(job.InSite(job.job.name));
  if (before && before->state == JobState::kBegun && before->key == job.job.key &&
      !RunIdIn(run).empty()) {
    *result = *before;
    return std::nullopt;
  }
  const SiteRecording& recording = job.workflow.FindRecording(RecordingName(job.job));
  const auto failure = RunStep(job, "odometry", OdometryCommand(job, recording));
  if (failure && failure->exit_code != kExitFailedRun) return failure;
  if (!RunIdIn(run).empty()) TakeVerdict(run, result);
  if (failure) {
    if (result->reason.empty()) return failure;
    return StepFailure{result->reason, result->remedy, kExitFailedRun};
  }
  result->key = job.job.key;
  result->state = JobState::kBegun;
  WriteJobResult(job.InSite(job.job.name), *result);
  return std::nullopt;
}

void AddReason(const StepFailure& failure, JobResult* result) {
  result->reason += (result->reason.empty() ? "" : "; ") + failure.reason;
  result->remedy = failure.remedy;
}

// A map as a step has put it somewhere, in another folder of the job; where the step fails, the map
// as it is, and why. Paths are those of the site's folder.
std::string PutBy(const SiteJob& job, const std::string& step, const std::string& map,
                  const std::string& output, std::vector<std::string> command, JobResult* result) {
  command.insert(command.begin() + 1, job.InSite(map));
  command.insert(command.end(), {"-o", job.Own(output)});
  const auto failure = RunStep(job, step, command);
  if (!failure) return job.job.name + "/" + output;
  std::error_code error;
  fs::remove_all(job.Own(output), error);  // of before
  AddReason(*failure, result);
  return map;
}

const SiteRecording& FirstRecording(const SiteJob& job, const JobMap& map) {
  return job.workflow.FindRecording(map.recordings.front());
}

JobMap PutOnControl(const SiteJob& job, const JobMap& map, const std::string& output,
                    JobResult* result) {
  const SiteControl* control = FindControl(job.workflow.site, FirstRecording(job, map).building);
  if (control == nullptr) return map;
  std::vector<std::string> command = {"georeference", "--control", control->points};
  if (!control->crs.empty()) command.insert(command.end(), {"--crs", control->crs});
  JobMap placed = map;
  placed.path = PutBy(job, "control-" + output, map.path, output, command, result);
  if (placed.path == map.path) return map;
  const ControlFit fit = ReadControlFit(job.InSite(placed.path));
  placed.points_given = static_cast<int>(fit.points.size());
  placed.points_used = static_cast<int>(
      std::ranges::count(fit.points, ControlStatus::kUsed, &ControlResidual::status));
  placed.rms_mm = 1e3 * fit.rms_m;
  return placed;
}

// The map of a result that differs by its control points alone.
bool HasMapBefore(const SiteJob& job, const std::optional<JobResult>& before) {
  const auto of_map = [](const std::string& key) { return key.substr(0, key.find(' ')); };
  return before && before->state == JobState::kDone && of_map(before->key) == of_map(job.job.key) &&
         !MapIdIn(job.Own("map")).empty();
}

JobResult MapRecording(const SiteJob& job) {
  JobResult result;
  const auto before = ReadJobResult(job.InSite(job.job.name));
  std::optional<StepFailure> failure;
  if (HasMapBefore(job, before)) {
    result = *before;
  } else if (!(failure = MakeSiteRun(job, &result))) {
    failure = RunStep(job, "map", WithConfig(job, {"map", job.Own("run"), "-o", job.Own("map")}));
  }
  result.state = failure ? JobState::kFailed : JobState::kDone;
  if (failure) {
    result.reason = failure->reason;
    result.remedy = failure->remedy;
    return result;
  }
  JobMap map = {job.job.name + "/map", {RecordingName(job.job)}};
  JobResult unplaced;  // one walk need not see the points of all
  map = PutOnControl(job, map, "placed", &unplaced);
  if (!unplaced.reason.empty())
    spdlog::info("{}: not on control points: {}", job.job.name, unplaced.reason);
  result.maps = {map};
  return result;
}

// All that jobs before this one made.
std::vector<JobMap> GatherMaps(const SiteJob& job) {
  std::vector<JobMap> maps;
  for (const std::string& name : job.job.after) {
    const auto result = ReadJobResult(job.InSite(name));
    if (!result || result->state != JobState::kDone) continue;
    maps.insert(maps.end(), result->maps.begin(), result->maps.end());
  }
  return maps;
}

std::vector<MapFolder> FoldersToPlace(const SiteJob& job, const std::vector<JobMap>& maps) {
  std::vector<MapFolder> folders;
  for (const JobMap& map : maps) {
    const SiteRecording& recording = FirstRecording(job, map);
    folders.push_back({job.InSite(map.path), recording.name, recording.storey, recording.date});
  }
  return folders;
}

// Takes a place in the world of a group into the reference system of a map that lies in it, and
// names that; nothing where none lies in one.
std::optional<std::string> PutOnEarth(const std::vector<MapFolder>& folders,
                                      const MapPlacement& placement, std::size_t group,
                                      Eigen::Vector3d* p_m) {
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (placement.maps[i].group != group) continue;
    const auto georeference = MapSourceIn(folders[i].path).georeference;
    if (!georeference) continue;
    *p_m = *georeference * (placement.maps[i].T_group_map.Inverse() * *p_m);
    return georeference->crs;
  }
  return std::nullopt;
}

Json ChangeJson(const std::vector<MapFolder>& folders, const MapPlacement& placement,
                const DatedChange& dated) {
  const MapChange& change = dated.change;
  Eigen::Vector3d middle_m = 0.5 * (change.least_world + change.most_world);
  Json json = {{"what", change.is_wall ? "wall" : "thing"},
               {"is_new", change.is_new},
               {"after", dated.after},
               {"by", dated.by},
               {"world_of", folders[dated.group].name},
               {"size_m", PointJson(change.most_world - change.least_world)},
               {"area_m2", RoundedForJson(change.area_m2)}};
  const auto crs = PutOnEarth(folders, placement, dated.group, &middle_m);
  if (crs) json["crs"] = *crs;
  json["middle_m"] = PointJson(middle_m);
  return json;
}

// Where the maps of a building's recordings lie to each other, and what changed between them.
JobResult PlaceRecordings(const SiteJob& job) {
  const std::vector<JobMap> maps = GatherMaps(job);
  const std::vector<MapFolder> folders = FoldersToPlace(job, maps);
  if (folders.empty()) return FailedResult({"found no map to place", "see the recordings", 0});
  const PlacedFolders placed =
      PlaceFolders(folders, false, job.Own("pairs.json"), StageProgress("places"));
  WritePlacement(job.Own(kPlacementFile), folders, placed);
  JobResult result;
  result.state = JobState::kDone;
  for (const PairApart& pair : placed.placement.apart) {
    result.apart.push_back({maps[pair.first].path, maps[pair.second].path, pair.reason});
  }
  for (const DatedChange& dated : placed.changes) {
    result.changes.push_back(ChangeJson(folders, placed.placement, dated));
  }
  return result;
}

// Steps on the way, and what an earlier job left.
void RemoveOtherMaps(const SiteJob& job, const std::vector<JobMap>& kept) {
  std::error_code error;
  for (int i = 1;; ++i) {
    const std::string path = fmt::format("{}/map-{}", job.job.name, i);
    if (std::ranges::find(kept, path, &JobMap::path) != kept.end()) continue;
    if (!fs::exists(job.InSite(path), error)) return;
    fs::remove_all(job.InSite(path), error);
  }
}

// Maps by the group that they lie in, in their order.
std::vector<std::vector<JobMap>> GroupMaps(const std::vector<JobMap>& maps,
                                           const std::string& placement) {
  std::vector<std::vector<JobMap>> groups;
  std::map<std::size_t, std::size_t> by_number;
  for (const JobMap& map : maps) {
    const std::size_t number = FindPlaceOfName(placement, map.recordings.front()).group;
    const auto [group, is_new] = by_number.emplace(number, groups.size());
    if (is_new) groups.emplace_back();
    groups[group->second].push_back(map);
  }
  return groups;
}

// The maps that lie together become one.
JobResult MergeMapsOfSite(const SiteJob& job) {
  const std::vector<JobMap> maps = GatherMaps(job);
  if (maps.empty())
    return FailedResult({"found no map of those to merge", "see the recordings", 0});
  JobResult result;
  result.state = JobState::kDone;
  if (maps.size() == 1) {
    result.maps = maps;
    RemoveOtherMaps(job, maps);
    return result;
  }
  const std::string& places = job.job.after.back();
  const auto placed = ReadJobResult(job.InSite(places));
  if (!placed || placed->state != JobState::kDone) {
    return FailedResult({placed ? places + ": " + placed->reason : "found no " + places,
                         placed ? placed->remedy : "run the site again", 0});
  }
  const std::string placement = job.InSite(places + "/" + kPlacementFile);
  for (const std::vector<JobMap>& group : GroupMaps(maps, placement)) {
    JobMap merged = group.front();
    if (group.size() > 1) {
      merged = {fmt::format("{}/map-{}", job.job.name, result.maps.size() + 1), {}};
      std::vector<std::string> command = {"merge", "--placed", placement, "-o",
                                          job.InSite(merged.path)};
      for (const JobMap& map : group) {
        command.push_back(job.InSite(map.path));
        merged.recordings.insert(merged.recordings.end(), map.recordings.begin(),
                                 map.recordings.end());
      }
      const std::string step = fmt::format("merge-{}", result.maps.size() + 1);
      if (const auto failure = RunStep(job, step, WithConfig(job, command))) {
        return FailedResult(*failure);
      }
    }
    result.maps.push_back(merged);
  }
  RemoveOtherMaps(job, result.maps);
  return result;
}

// Else of a storey of it.
bool IsOfBuilding(const SiteJob& job, const SiteRecording& recording) {
  return job.job.name == std::string(kExportJobs) + "/" + FolderName(recording.building);
}

std::string LayOnPlan(const SiteJob& job, const std::string& map, int number, JobResult* result) {
  if (!job.job.plan) return map;
  return PutBy(job, fmt::format("register-{}", number), map, fmt::format("map-{}", number),
               {"register", "--plan", job.job.plan->image, "--plan-pixel-m",
                fmt::format("{}", job.job.plan->pixel_m)},
               result);
}

// The option of the site's names; none, with a reason, of a map that lies in another system than
// they do: one of several may not be placed.
std::vector<std::string> NamesOption(const SiteJob& job, const std::string& map,
                                     JobResult* result) {
  const std::string& path = job.workflow.site.names;
  if (path.empty()) return {};
  const Names names = ReadNames(path);
  if (LiesInSystem(names, MapSourceIn(job.InSite(map)))) return {"--names", path};
  AddReason({fmt::format("exported without names: those of {} are in {}, where {} was not placed",
                         path, names.crs, map),
             "control points that place it, or names without crs", 0},
            result);
  spdlog::warn("{}: {}", job.job.name, result->reason);
  return {};
}

// The building, and the storey that is exported alone.
std::string TitleOfExport(const SiteJob& job, const SiteRecording& first) {
  return first.building + (IsOfBuilding(job, first) ? "" : ", " + first.storey);
}

// Exports one map in all formats, and as a page.
std::optional<StepFailure> ExportOne(const SiteJob& job, const JobMap& map,
                                     const std::string& output,
                                     const std::vector<std::string>& names) {
  std::vector<std::string> formats = job.workflow.site.exports;
  const bool has_page = std::erase(formats, kPageFormat) > 0;
  const std::string name = fs::path(output).filename().string();
  const auto run = [&](const std::string& step, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), names.begin(), names.end());
    return RunStep(job, step + "-" + name, arguments);
  };
  const std::string path = job.InSite(map.path), to = job.InSite(output);
  std::optional<StepFailure> failure;
  if (has_page) {
    failure = run("page", {"view", path, "-o", to + ".html", "--title",
                           TitleOfExport(job, FirstRecording(job, map))});
  }
  if (failure || formats.empty()) return failure;
  return run("export",
             {"export", path, "-o", to, "--format", fmt::format("{}", fmt::join(formats, ","))});
}

// What was made before, of this map or of one that was apart. False where there was none.
bool RemoveExport(const SiteJob& job, int number) {
  std::error_code error;
  bool is_there = false;
  for (const char* name : {"{}", "{}.html", "map-{}", "placed-{}"}) {
    const std::string path = job.Own(fmt::format(fmt::runtime(name), number));
    is_there = is_there || fs::exists(path, error);
    fs::remove_all(path, error);
  }
  return is_there;
}

// One of the job's maps, laid on plan and control. Its result has the export as its map.
JobResult ExportMapOfSite(const SiteJob& job, const JobMap& map, int number) {
  JobResult result;
  result.state = JobState::kDone;
  RemoveExport(job, number);
  JobMap placed = map;
  placed.path = LayOnPlan(job, map.path, number, &result);
  placed = PutOnControl(job, placed, fmt::format("placed-{}", number), &result);
  const std::string output = fmt::format("{}/{}", job.job.name, number);
  const std::vector<std::string> names = NamesOption(job, placed.path, &result);
  if (const auto failure = ExportOne(job, placed, output, names)) {
    AddReason(*failure, &result);
    result.state = JobState::kFailed;
  }
  std::error_code error;
  for (const std::string& made : {output + ".html", output}) {
    if (fs::exists(job.InSite(made), error)) placed.path = made;
  }
  result.maps = {placed};
  return result;
}

// A storey, or a map among others, may lie where no points are; of a building with control points
// some map lies on them.
bool MissesControl(const SiteJob& job, const JobResult& result) {
  const SiteRecording& first = FirstRecording(job, result.maps.front());
  return IsOfBuilding(job, first) && FindControl(job.workflow.site, first.building) &&
         std::ranges::all_of(result.maps, [](const JobMap& map) { return map.points_given == 0; });
}

JobResult ExportMaps(const SiteJob& job) {
  JobResult result;
  const std::vector<JobMap> maps = GatherMaps(job);
  if (maps.empty()) return FailedResult({"found no map to export", "see the recordings", 0});
  result.state = JobState::kDone;
  int number = 0;
  for (const JobMap& map : maps) {
    const JobResult one = ExportMapOfSite(job, map, ++number);
    result.maps.push_back(one.maps.front());
    if (one.state == JobState::kFailed) result.state = JobState::kFailed;
    if (one.reason.empty()) continue;
    const std::string whose = maps.size() > 1 ? map.recordings.front() + ": " : "";
    AddReason({whose + one.reason, one.remedy, 0}, &result);
  }
  while (RemoveExport(job, ++number)) {
  }
  if (MissesControl(job, result)) result.state = JobState::kFailed;
  return result;
}

JobResult DoJob(const SiteJob& job) {
  if (IsRecordingJob(job.job)) return MapRecording(job);
  if (job.job.name.starts_with(kPlaceJobs)) return PlaceRecordings(job);
  return job.job.name.starts_with(kMergeJobs) ? MergeMapsOfSite(job) : ExportMaps(job);
}

void WaitForTurn(const std::string& name, FolderTurn* turn) {
  constexpr auto kBetweenLooks = std::chrono::seconds(1);
  bool is_told = false;
  while (!turn->Take()) {
    if (!is_told) spdlog::info("{}: another process is at it: waits", name);
    is_told = true;
    std::this_thread::sleep_for(kBetweenLooks);
    if (Interrupted()) throw StoppedError("interrupted");
  }
}

}  // namespace

void RunSiteJob(const std::string& folder, const std::string& name, int threads) {
  CheckThreads(threads);
  const Workflow workflow = ReadWorkflow(folder);
  const SiteJob job{folder, workflow, workflow.Find(name), threads};
  const std::string own = job.InSite(name);
  MakeFolder(own);
  FolderTurn turn(own);
  WaitForTurn(name, &turn);
  if (IsCurrent(folder, workflow, job.job)) {
    spdlog::info("{}: kept from before", name);
    return;
  }
  // What is merged and exported is what is there now.
  const std::string key = ComputeJobKey(folder, workflow, job.job);
  JobResult result;
  try {
    result = DoJob(job);
  } catch (const StoppedError&) {
    throw;
  } catch (const Error& error) {
    result = FailedResult(FailureInWords(error.what(), job.Own("*.log"), kExitFailure));
  }
  result.key = key;
  WriteJobResult(own, result);
  if (result.state == JobState::kFailed) spdlog::warn("{}: failed: {}", name, result.reason);
}

}  // namespace slcmap::commands
