#include "apps/compare_runs.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "apps/child_process.h"
#include "apps/commands.h"
#include "apps/map_stage.h"
#include "apps/verdict_report.h"
#include "data/checksum.h"
#include "data/json_file.h"
#include "data/progress.h"
#include "data/sequence.h"
#include "data/version.h"
#include "odometry/options.h"
#include "odometry/verdict/verdict_options.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr size_t kKeyLength = 10;  // of a checksum, in folders' names

// Everything that decides what a run is; the text is also the configuration that it gets.
std::string OptionsOf(const MethodToRun& method, int repeat) {
  OdometryOptions odometry;
  VerdictOptions verdict;
  if (!method.config.empty()) {
    odometry = OdometryOptions::FromYaml(method.config);
    verdict = VerdictOptions::FromYaml(method.config);
  }
  if (!method.method.empty()) odometry.method = MethodFromName(method.method);
  odometry.Check();
  odometry.points.max_points = PointsOfRepeat(odometry.points.max_points, repeat);
  return odometry.ToYaml() + verdict.ToYaml() + ReadMappingOptions(method.config).ToYaml();
}

// True where a stage has left a whole result.
bool IsFinished(const std::string& summary) {
  std::error_code error;
  if (!fs::exists(summary, error)) return false;
  try {
    return ParseJsonFile(summary, [](const Json& json) { return json.at("complete").get<bool>(); });
  } catch (const DataError&) {
    return false;
  }
}

// The last thing that a stage said, which is the error where it ended with one.
std::string LastLine(const std::string& log_path) {
  std::string text = ReadFile(log_path);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

// Runs a stage unless its summary says that it is done; the reason where it has no result.
std::string RunStage(const std::vector<std::string>& arguments, const std::string& summary,
                     const std::string& log_path) {
  if (IsFinished(summary)) return "";
  const int code = RunChild(arguments, log_path);
  if (Interrupted()) throw StoppedError("interrupted; finished runs are kept");
  if ((code == kExitSuccess || code == kExitFailedRun) && IsFinished(summary)) return "";
  if (code >= kExitSignal) {
    return fmt::format("ended by signal {}; {}", code - kExitSignal, log_path);
  }
  const std::string last = LastLine(log_path);
  return last.empty() ? fmt::format("ended with {}; {}", code, log_path) : last;
}

struct Repeat {
  RunFolders folders;
  std::string problem;
};

Repeat RunRepeat(const MethodToRun& method, const std::string& sequence, const std::string& id,
                 const std::string& sequence_name, int repeat, const RunPlan& plan) {
  const std::string options = OptionsOf(method, repeat);
  const std::string key = Checksum(id + kVersion + options).substr(0, kKeyLength);
  const std::string folder =
      fmt::format("{}/{}/{}-{}-{}", plan.folder, sequence_name, method.name, repeat, key);
  MakeFolder(folder);
  if (IsFinished(folder + "/run/run.json")) spdlog::info("{}: kept from before", folder);
  const std::string config = folder + "/options.yaml";
  WriteFile(config, options);
  Repeat made{{folder + "/run", folder + "/map", plan.dense_maps ? folder + "/dense_map" : ""}, ""};
  made.problem = RunStage({"odometry", sequence, "-o", made.folders.run, "--config", config,
                           "--threads", std::to_string(plan.threads)},
                          made.folders.run + "/run.json", folder + "/odometry.log");
  if (!made.problem.empty()) return made;
  made.problem =
      RunStage({"map", made.folders.run, "-o", made.folders.map, "--sparse", "--config", config},
               made.folders.map + "/map.json", folder + "/map.log");
  if (!made.problem.empty() || !plan.dense_maps) return made;
  const std::string problem =
      RunStage({"map", made.folders.run, "-o", made.folders.dense_map, "--config", config},
               made.folders.dense_map + "/map.json", folder + "/dense_map.log");
  if (problem.empty()) return made;
  spdlog::warn("{}: no dense map: {}", folder, problem);
  made.folders.dense_map.clear();
  return made;
}

}  // namespace

std::string SequenceId(const std::string& sequence) {
  const fs::path folder = FindAslFolder(sequence);
  std::string text = fs::weakly_canonical(folder).string();
  for (const char* name : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv", "cam0/sensor.yaml",
                           "cam1/sensor.yaml", "imu0/sensor.yaml"}) {
    std::error_code error;
    if (fs::is_regular_file(folder / name, error)) {
      text += "\n" + Checksum(ReadFile((folder / name).string()));
    }
  }
  return text;
}

void CheckMethod(const MethodToRun& method) { OptionsOf(method, 0); }

int PointsOfRepeat(int max_points, int repeat) {
  // 1, 0.9, 1.1, 0.8, 1.2, ...
  const double change = 0.1 * ((repeat + 1) / 2) * (repeat % 2 == 1 ? -1 : 1);
  return std::max(1, static_cast<int>(std::lround(max_points * (1 + change))));
}

MeasuredMethod RunMethod(const MethodToRun& method, const std::string& sequence,
                         const std::string& sequence_name, const RunPlan& plan) {
  MeasuredMethod measured{method.name, {}, "", {}};
  const std::string id = SequenceId(sequence);
  for (int repeat = 0; repeat < plan.repeats; ++repeat) {
    spdlog::info("{}: {}, run {} of {}", sequence_name, method.name, repeat + 1, plan.repeats);
    const Repeat made = RunRepeat(method, sequence, id, sequence_name, repeat, plan);
    if (made.problem.empty()) {
      measured.runs.push_back(made.folders);
      continue;
    }
    spdlog::warn("{}: {}: {}", sequence_name, method.name, made.problem);
    measured.remarks.push_back(fmt::format("run {} failed: {}", repeat + 1, made.problem));
  }
  return measured;
}

}  // namespace slcmap
