#include "apps/batch/workflow.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "data/io/json.h"
#include "data/source/sequence_options_json.h"
#include "data/version.h"

namespace slcmap::inline batch {
namespace {

constexpr char kFormat[] = "slcmap job";
constexpr int kVersionOfFormat = 1;
constexpr const char* kStates[] = {"begun", "done", "failed"};

std::string PathOfResult(const std::string& folder) { return folder + "/result.json"; }

JobState ParseState(const std::string& path, const std::string& name) {
  for (const JobState state : {JobState::kBegun, JobState::kDone, JobState::kFailed}) {
    if (JobStateName(state) == name) return state;
  }
  throw DataError(fmt::format("{}: state: found '{}', expected one of {}", path, name,
                              fmt::join(kStates, ", ")));
}

// That it holds what the page of a site shows; Json's own error where not.
void CheckChange(const Json& change) {
  for (const char* key : {"what", "after", "by", "world_of"}) change.at(key).get<std::string>();
  for (const char* key : {"middle_m", "size_m"}) change.at(key).get<std::array<double, 3>>();
  change.at("is_new").get<bool>();
  change.value("crs", std::string());
}

JobResult ParseResult(const std::string& path, const Json& json) {
  CheckFormat(path, json, kFormat, kVersionOfFormat, kVersionOfFormat);
  JobResult result;
  result.key = json.at("key");
  result.state = ParseState(path, json.at("state"));
  result.reason = json.at("reason");
  result.remedy = json.at("remedy");
  result.verdict = json.at("verdict");
  result.length_m = json.at("length_m");
  for (const Json& map : json.at("maps")) {
    result.maps.push_back({map.at("path"), map.at("recordings").get<std::vector<std::string>>(),
                           map.value("points_used", 0), map.value("points_given", 0),
                           map.value("rms_mm", 0.0)});
  }
  for (const Json& pair : json.at("apart")) {
    result.apart.push_back({pair.at("first"), pair.at("second"), pair.at("reason")});
  }
  result.changes = json.value("changes", Json::array());
  for (const Json& change : result.changes) CheckChange(change);
  return result;
}

}  // namespace

std::string JobStateName(JobState state) { return kStates[static_cast<int>(state)]; }

std::optional<JobResult> ReadJobResult(const std::string& folder) {
  const std::string path = PathOfResult(folder);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  try {
    return ParseJsonFile(path, [&](const Json& json) { return ParseResult(path, json); });
  } catch (const DataError& damage) {
    spdlog::warn("{}; its job is done again", damage.what());
    return std::nullopt;
  }
}

Json ResultJson(const JobResult& result) {
  Json json = {{"state", JobStateName(result.state)},
               {"reason", result.reason},
               {"remedy", result.remedy},
               {"verdict", result.verdict},
               {"length_m", RoundedForJson(result.length_m)},
               {"maps", Json::array()},
               {"apart", Json::array()},
               {"changes", result.changes}};
  for (const JobMap& map : result.maps) {
    json["maps"].push_back({{"path", map.path}, {"recordings", map.recordings}});
    if (map.points_given == 0) continue;
    json["maps"].back().update({{"points_used", map.points_used},
                                {"points_given", map.points_given},
                                {"rms_mm", RoundedForJson(map.rms_mm)}});
  }
  for (const MapsApart& pair : result.apart) {
    json["apart"].push_back(
        {{"first", pair.first}, {"second", pair.second}, {"reason", pair.reason}});
  }
  return json;
}

void WriteJobResult(const std::string& folder, const JobResult& result) {
  Json json = {{"format", kFormat}, {"version", kVersionOfFormat}, {"key", result.key}};
  json.update(ResultJson(result));
  MakeFolder(folder);
  ReplaceFile(PathOfResult(folder), JsonText(json));
}

namespace {

namespace fs = std::filesystem;

constexpr char kWorkflowFormat[] = "slcmap site";
constexpr int kWorkflowVersion = 1;

// A job merges so many results at most: its merges go one after the other.
constexpr std::size_t kMostMerged = 4;

std::string JobName(const char* kind, const std::string& name) {
  return std::string(kind) + "/" + name;
}

// The job whose result holds all of those, which it adds with those before it. Letters that names
// do not have tell its own name from others.
std::string AddMerges(const std::string& node, std::vector<std::string> inputs,
                      const std::string& places, std::vector<Job>* jobs) {
  for (int level = 1; inputs.size() > kMostMerged; ++level) {
    std::vector<std::string> merged;
    for (std::size_t from = 0; from < inputs.size(); from += kMostMerged) {
      const auto begin = inputs.begin() + static_cast<std::ptrdiff_t>(from);
      const auto end =
          begin + static_cast<std::ptrdiff_t>(std::min(kMostMerged, inputs.size() - from));
      merged.push_back(AddMerges(fmt::format("{}~{}.{}", node, level, merged.size() + 1),
                                 {begin, end}, places, jobs));
    }
    inputs = std::move(merged);
  }
  if (inputs.size() == 1) return inputs.front();
  inputs.push_back(places);
  jobs->push_back({JobName(kMergeJobs, node), std::move(inputs), "", {}});
  return jobs->back().name;
}

std::string NodeName(const std::string& building, const std::string& storey) {
  return storey.empty() ? FolderName(building) : FolderName(building) + "+" + FolderName(storey);
}

// The recordings of a storey, in the site's order.
struct StoreyJobs {
  std::string storey;
  std::vector<std::string> jobs;
};

// Storeys by their first recordings; those of none last: they may join the others.
std::vector<StoreyJobs> ListStoreys(const Site& site, const std::string& building) {
  std::vector<StoreyJobs> storeys;
  for (const bool named : {true, false}) {
    for (const SiteRecording& recording : site.recordings) {
      if (recording.building != building || recording.storey.empty() == named) continue;
      auto storey = std::ranges::find(storeys, recording.storey, &StoreyJobs::storey);
      if (storey == storeys.end()) {
        storey = storeys.insert(storeys.end(), {recording.storey, {}});
      }
      storey->jobs.push_back(JobName(kRecordingJobs, recording.name));
    }
  }
  return storeys;
}

std::optional<SitePlan> FindPlan(const Site& site, const std::string& building,
                                 const std::string& storey) {
  for (const SitePlan& plan : site.plans) {
    if (plan.building == building && plan.storey == storey) return plan;
  }
  return std::nullopt;
}

void AddBuilding(const Site& site, const std::string& building, std::vector<Job>* jobs) {
  const std::vector<StoreyJobs> storeys = ListStoreys(site, building);
  const std::string node = NodeName(building, "");
  Job places{JobName(kPlaceJobs, node), {}, "", {}};
  for (const SiteRecording& recording : site.recordings) {
    if (recording.building == building) {
      places.after.push_back(JobName(kRecordingJobs, recording.name));
    }
  }
  if (places.after.size() > 1) jobs->push_back(places);
  std::vector<std::string> merged;
  for (const StoreyJobs& storey : storeys) {
    if (storey.storey.empty() && storeys.size() > 1) {
      merged.insert(merged.end(), storey.jobs.begin(), storey.jobs.end());
      continue;
    }
    merged.push_back(AddMerges(NodeName(building, storey.storey), storey.jobs, places.name, jobs));
    const auto plan = FindPlan(site, building, storey.storey);
    if (plan && storeys.size() > 1) {
      jobs->push_back(
          {JobName(kExportJobs, NodeName(building, storey.storey)), {merged.back()}, "", plan});
    }
  }
  auto plan = FindPlan(site, building, "");
  if (!plan && storeys.size() == 1) plan = FindPlan(site, building, storeys.front().storey);
  const std::string all = AddMerges(node, merged, places.name, jobs);
  if (site.exports.empty() && !plan && !FindControl(site, building)) return;
  jobs->push_back({JobName(kExportJobs, node), {all}, "", plan});
}

Json RecordingJson(const SiteRecording& recording) {
  return {{"name", recording.name},
          {"path", recording.path},
          {"opened", OpenedJson(recording.opened)},
          {"building", recording.building},
          {"storey", recording.storey},
          {"date", recording.date}};
}

SiteRecording ParseRecording(const Json& json) {
  return {json.at("name"),     json.at("path"),   ParseOpened(json),
          json.at("building"), json.at("storey"), json.at("date")};
}

Json JobJson(const Job& job) {
  Json json = {{"after", job.after}, {"key", job.key}};
  if (job.plan) json["plan"] = {{"image", job.plan->image}, {"pixel_m", job.plan->pixel_m}};
  return json;
}

Job ParseJob(const std::string& name, const Json& json) {
  Job job{name, json.at("after"), json.at("key"), {}};
  if (json.contains("plan")) {
    job.plan = SitePlan{"", "", json.at("plan").at("image"), json.at("plan").at("pixel_m")};
  }
  return job;
}

Workflow ParseWorkflow(const std::string& path, const Json& json) {
  CheckFormat(path, json, kWorkflowFormat, kWorkflowVersion, kWorkflowVersion);
  Workflow workflow;
  workflow.program = json.at("program");
  workflow.site.method = json.at("method");
  workflow.site.config = json.at("config");
  workflow.site.exports = json.at("exports").get<std::vector<std::string>>();
  workflow.site.names = json.value("names", std::string());
  for (const Json& entry : json.value("control", Json::array())) {
    workflow.site.control.push_back({entry.at("building"), entry.at("points"), entry.at("crs")});
  }
  for (const Json& entry : json.at("recordings")) {
    workflow.site.recordings.push_back(ParseRecording(entry));
  }
  for (const auto& [name, entry] : json.at("jobs").items()) {
    workflow.jobs.push_back(ParseJob(name, entry));
  }
  return workflow;
}

// "" of none: a job that needs it says so.
std::string BytesOfFile(const std::string& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) ? ReadFile(path) : "";
}

}  // namespace

const Job& Workflow::Find(const std::string& name) const {
  const auto found = std::ranges::find(jobs, name, &Job::name);
  if (found != jobs.end()) return *found;
  throw DataError(fmt::format("{}: found no job {}, expected one of those", kWorkflowFile, name));
}

const SiteRecording& Workflow::FindRecording(const std::string& name) const {
  const auto found = std::ranges::find(site.recordings, name, &SiteRecording::name);
  if (found != site.recordings.end()) return *found;
  throw DataError(
      fmt::format("{}: found no recording {}, expected one of those", kWorkflowFile, name));
}

bool IsRecordingJob(const Job& job) {
  return job.name.starts_with(std::string(kRecordingJobs) + "/");
}

std::string RecordingName(const Job& job) { return job.name.substr(job.name.find('/') + 1); }

std::vector<Job> PlanJobs(const Site& site) {
  std::vector<Job> jobs;
  std::vector<std::string> buildings;
  for (const SiteRecording& recording : site.recordings) {
    jobs.push_back({JobName(kRecordingJobs, recording.name), {}, "", {}});
    if (std::ranges::find(buildings, recording.building) == buildings.end()) {
      buildings.push_back(recording.building);
    }
  }
  for (const std::string& building : buildings) AddBuilding(site, building, &jobs);
  return jobs;
}

void WriteWorkflow(const std::string& folder, const Workflow& workflow) {
  Json json = {{"format", kWorkflowFormat},      {"version", kWorkflowVersion},
               {"program", workflow.program},    {"method", workflow.site.method},
               {"config", workflow.site.config}, {"exports", workflow.site.exports},
               {"names", workflow.site.names},   {"recordings", Json::array()},
               {"jobs", Json::object()}};
  for (const SiteRecording& recording : workflow.site.recordings) {
    json["recordings"].push_back(RecordingJson(recording));
  }
  for (const SiteControl& control : workflow.site.control) {
    json["control"].push_back(
        {{"building", control.building}, {"points", control.points}, {"crs", control.crs}});
  }
  for (const Job& job : workflow.jobs) json["jobs"][job.name] = JobJson(job);
  ReplaceFile(folder + "/" + kWorkflowFile, JsonText(json));
}

Workflow ReadWorkflow(const std::string& folder) {
  const std::string path = folder + "/" + kWorkflowFile;
  return ParseJsonFile(path, [&](const Json& json) { return ParseWorkflow(path, json); });
}

std::string MapIdIn(const std::string& folder) {
  const std::string path = folder + "/map.json";
  std::error_code error;
  if (!fs::exists(path, error)) return "";
  return ParseJsonFile(path, [](const Json& json) { return json.at("id").get<std::string>(); });
}

std::string DescribeControl(const Site& site, const std::string& building) {
  const SiteControl* control = FindControl(site, building);
  return control ? control->crs + "\n" + BytesOfFile(control->points) : "";
}

std::string ComputeJobKey(const std::string& folder, const Workflow& workflow, const Job& job) {
  if (IsRecordingJob(job)) return job.key;
  std::string text = std::string(kVersion) + "\n";
  if (!workflow.site.config.empty()) text += BytesOfFile(folder + "/" + workflow.site.config);
  for (const std::string& before : job.after) {
    if (before.starts_with(kPlaceJobs)) {
      text += BytesOfFile(folder + "/" + before + "/" + kPlacementFile);
    }
    const auto result = ReadJobResult(folder + "/" + before);
    if (!result || result->state != JobState::kDone) continue;
    for (const JobMap& map : result->maps) {
      text += fmt::format("{} {}\n", map.path, MapIdIn(folder + "/" + map.path));
      // Which maps may be joined hangs on what the site says of them.
      for (const std::string& name : map.recordings) {
        const SiteRecording& recording = workflow.FindRecording(name);
        text += name + " " + recording.storey + " " + recording.date + "\n";
      }
    }
  }
  if (job.name.starts_with(kExportJobs)) {
    text += fmt::format("{}\n{}", fmt::join(workflow.site.exports, " "),
                        BytesOfFile(workflow.site.names));
    for (const SiteControl& control : workflow.site.control) {
      text += DescribeControl(workflow.site, control.building);
    }
  }
  if (job.plan) text += fmt::format("{}\n{}", job.plan->pixel_m, BytesOfFile(job.plan->image));
  return Checksum(text);
}

bool IsCurrent(const std::string& folder, const Workflow& workflow, const Job& job) {
  const auto result = ReadJobResult(folder + "/" + job.name);
  if (!result || result->state != JobState::kDone) return false;
  std::error_code error;
  for (const JobMap& map : result->maps) {
    if (!fs::exists(folder + "/" + map.path, error)) return false;
  }
  return result->key == ComputeJobKey(folder, workflow, job);
}

}  // namespace slcmap::batch
