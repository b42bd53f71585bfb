// The jobs of a site, as the workflow's engine starts them: each is this program again.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "apps/batch/results.h"
#include "apps/batch/workflow.h"
#include "apps/commands/check.h"
#include "apps/commands/child_process.h"
#include "apps/commands/commands.h"
#include "apps/commands/options.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/core/error.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/io/trajectory.h"
#include "data/source/asl_files.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

// Trajectories of one storey are nearer to each other in height than this, of two farther apart.
constexpr double kHalfStorey_m = 1.5;

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

JobResult MapRecording(const SiteJob& job) {
  JobResult result;
  auto failure = MakeSiteRun(job, &result);
  if (!failure) {
    failure = RunStep(job, "map", WithConfig(job, {"map", job.Own("run"), "-o", job.Own("map")}));
  }
  result.state = failure ? JobState::kFailed : JobState::kDone;
  if (failure) {
    result.reason = failure->reason;
    result.remedy = failure->remedy;
  } else {
    result.maps = {{job.job.name + "/map", {RecordingName(job.job)}}};
  }
  return result;
}

// All that jobs before this one made; `apart` are pairs that need not be tried again.
JobResult GatherMaps(const SiteJob& job) {
  JobResult gathered;
  for (const std::string& name : job.job.after) {
    const auto result = ReadJobResult(job.InSite(name));
    if (!result || result->state != JobState::kDone) continue;
    gathered.maps.insert(gathered.maps.end(), result->maps.begin(), result->maps.end());
    gathered.apart.insert(gathered.apart.end(), result->apart.begin(), result->apart.end());
  }
  return gathered;
}

// Of the recordings of a map of which the site names the storey, in the map's world.
std::map<std::string, double> MeasureHeights(const SiteJob& job, const JobMap& map) {
  std::map<std::string, std::string> recordings;  // by their runs
  for (const std::string& name : map.recordings) {
    if (job.workflow.FindRecording(name).storey.empty()) continue;
    const std::string own = fmt::format("{}/{}/map", kRecordingJobs, name);
    recordings[MapSourceIn(job.InSite(own)).run_id] = name;
  }
  const std::string folder = job.InSite(map.path);
  const Trajectory poses = ReadTrajectory(folder + "/trajectory.tum");
  std::map<std::string, double> heights_m;
  for (const MergedRun& run : MapSourceIn(folder).merged) {
    const auto recording = recordings.find(run.run_id);
    if (recording == recordings.end() || !run.poses_ns) continue;
    std::vector<double> its_heights_m;
    for (const StampedPose& pose : poses) {
      if (pose.stamp_ns < run.poses_ns->from_ns || pose.stamp_ns > run.poses_ns->to_ns) continue;
      its_heights_m.push_back(pose.T_world_imu.translation.z());
    }
    if (!its_heights_m.empty()) heights_m[recording->second] = Median(std::move(its_heights_m));
  }
  return heights_m;
}

// Why recordings cannot lie so: look-alike storeys fit onto each other. "" where they can.
std::string FindWrongHeights(const SiteJob& job, const JobMap& map) {
  const std::map<std::string, double> heights_m = MeasureHeights(job, map);
  for (auto a = heights_m.begin(); a != heights_m.end(); ++a) {
    for (auto b = std::next(a); b != heights_m.end(); ++b) {
      const std::string &storey_a = job.workflow.FindRecording(a->first).storey,
                        &storey_b = job.workflow.FindRecording(b->first).storey;
      const double apart_m = std::abs(a->second - b->second);
      if ((storey_a == storey_b) == (apart_m < kHalfStorey_m)) continue;
      return fmt::format(
          "found {} of storey {} and {} of storey {} {:.2f} m apart in height, expected {} than "
          "{} m",
          a->first, storey_a, b->first, storey_b, apart_m, storey_a == storey_b ? "less" : "more",
          kHalfStorey_m);
    }
  }
  return "";
}

// Merges maps two by two until none fits to another any more.
class SiteMerge {
 public:
  explicit SiteMerge(const SiteJob& job) : job_(job), result_(GatherMaps(job)) {
    for (const MapsApart& pair : result_.apart) tried_.insert({pair.first, pair.second});
  }

  JobResult Run() {
    while (MergeTwo()) {
    }
    KeepPairsOfMaps();
    RemoveOtherMaps();
    result_.state = JobState::kDone;
    if (result_.maps.empty()) {
      return FailedResult({"found no map of those to merge", "see the recordings", 0});
    }
    return failure_ ? FailedResult(*failure_) : result_;
  }

 private:
  bool MergeTwo() {
    for (std::size_t a = 0; a < result_.maps.size(); ++a) {
      for (std::size_t b = a + 1; b < result_.maps.size(); ++b) {
        if (failure_) return false;
        if (Merge(a, b)) return true;
      }
    }
    return false;
  }

  // False where they stay apart, now or as tried before.
  bool Merge(std::size_t a, std::size_t b) {
    const JobMap first = result_.maps[a], second = result_.maps[b];
    if (!tried_.insert({first.path, second.path}).second) return false;
    JobMap merged{fmt::format("{}/map-{}", job_.job.name, made_ + 1), first.recordings};
    merged.recordings.insert(merged.recordings.end(), second.recordings.begin(),
                             second.recordings.end());
    const std::string from = job_.InSite(second.path), to = job_.InSite(merged.path);
    const auto failure =
        RunStep(job_, fmt::format("merge-{}", tried_.size()),
                WithConfig(job_, {"merge", job_.InSite(first.path), from, "-o", to}));
    // What does not fit is told of the second map; anything else is no word on the two.
    if (failure &&
        !(failure->exit_code == kExitFailure && failure->reason.starts_with(from + ": "))) {
      failure_ = failure;
      return false;
    }
    const std::string apart =
        failure ? failure->reason.substr(from.size() + 2) : FindWrongHeights(job_, merged);
    if (!apart.empty()) {
      result_.apart.push_back({first.path, second.path, apart});
      return false;
    }
    ++made_;
    result_.maps[a] = merged;
    result_.maps.erase(result_.maps.begin() + static_cast<std::ptrdiff_t>(b));
    return true;
  }

  // What lies in one map in the end is not apart.
  void KeepPairsOfMaps() {
    std::set<std::string> paths;
    for (const JobMap& map : result_.maps) paths.insert(map.path);
    std::erase_if(result_.apart, [&](const MapsApart& pair) {
      return !paths.contains(pair.first) || !paths.contains(pair.second);
    });
  }

  // Steps on the way, and what an earlier job left.
  void RemoveOtherMaps() const {
    std::set<std::string> kept;
    for (const JobMap& map : result_.maps) kept.insert(map.path);
    std::error_code error;
    for (int i = 1;; ++i) {
      const std::string path = fmt::format("{}/map-{}", job_.job.name, i);
      if (i > made_ && !fs::exists(job_.InSite(path), error)) return;
      if (!kept.contains(path)) fs::remove_all(job_.InSite(path), error);
    }
  }

  const SiteJob& job_;
  JobResult result_;
  std::set<std::pair<std::string, std::string>> tried_;
  std::optional<StepFailure> failure_;
  int made_ = 0;
};

// A map with the plan that it is laid on; where it has no place there, the map as it is, and why.
std::string LayOnPlan(const SiteJob& job, const std::string& map, int number, JobResult* result) {
  if (!job.job.plan) return map;
  const std::string placed = job.Own(fmt::format("map-{}", number));
  const auto failure = RunStep(job, fmt::format("register-{}", number),
                               {"register", map, "--plan", job.job.plan->image, "--plan-pixel-m",
                                fmt::format("{}", job.job.plan->pixel_m), "-o", placed});
  if (!failure) return placed;
  result->reason += (result->reason.empty() ? "" : "; ") + failure->reason;
  result->remedy = failure->remedy;
  return map;
}

// Exports one map in all formats, and as a page.
std::optional<StepFailure> ExportOne(const SiteJob& job, const std::string& map,
                                     const std::string& output) {
  std::vector<std::string> formats = job.workflow.site.exports;
  const bool has_page = std::erase(formats, kPageFormat) > 0;
  const std::string name = fs::path(output).filename().string();
  if (has_page) {
    const std::string page = output + ".html";
    const std::string title = fs::path(job.job.name).filename().string();
    if (auto failure = RunStep(job, "page-" + name, {"view", map, "-o", page, "--title", title})) {
      return failure;
    }
  }
  if (formats.empty()) return std::nullopt;
  return RunStep(
      job, "export-" + name,
      {"export", map, "-o", output, "--format", fmt::format("{}", fmt::join(formats, ","))});
}

// Of a map that was apart before. False where there was none.
bool RemoveExport(const SiteJob& job, int number) {
  std::error_code error;
  bool is_there = false;
  for (const char* name : {"{}", "{}.html", "map-{}"}) {
    const std::string path = job.Own(fmt::format(fmt::runtime(name), number));
    is_there = is_there || fs::exists(path, error);
    fs::remove_all(path, error);
  }
  return is_there;
}

JobResult ExportMaps(const SiteJob& job) {
  JobResult result;
  const std::vector<JobMap> maps = GatherMaps(job).maps;
  if (maps.empty()) return FailedResult({"found no map to export", "see the recordings", 0});
  int number = 0;
  for (const JobMap& map : maps) {
    ++number;
    const std::string placed = LayOnPlan(job, job.InSite(map.path), number, &result);
    const std::string output = fmt::format("{}/{}", job.job.name, number);
    if (auto failure = ExportOne(job, placed, job.InSite(output))) return FailedResult(*failure);
    result.maps.push_back({job.job.name, map.recordings});
  }
  while (RemoveExport(job, ++number)) {
  }
  result.state = JobState::kDone;
  return result;
}

JobResult DoJob(const SiteJob& job) {
  if (IsRecordingJob(job.job)) return MapRecording(job);
  return job.job.name.starts_with(kMergeJobs) ? SiteMerge(job).Run() : ExportMaps(job);
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
