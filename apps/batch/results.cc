#include "apps/batch/results.h"

#include <spdlog/spdlog.h>

#include <array>
#include <filesystem>

#include "data/io/json.h"

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
    result.maps.push_back({map.at("path"), map.at("recordings").get<std::vector<std::string>>()});
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

}  // namespace slcmap::batch
