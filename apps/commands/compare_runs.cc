#include "apps/commands/compare_runs.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/commands/child_process.h"
#include "apps/commands/commands.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/odometry_stage.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/source/sequence.h"
#include "mapping/map/map_folder.h"
#include "odometry/options.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/verdict.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

constexpr size_t kKeyLength = 10;  // of a checksum, in folders' names
constexpr char kSaysShare[] = "slcmap: info: odometry ";

// Everything that decides what a run is; the text is also the configuration that it gets.
std::string FormatOptions(const MethodToRun& method, int repeat) {
  OdometryOptions odometry;
  VerdictOptions verdict;
  if (!method.config.empty()) {
    odometry = OdometryOptions::FromYaml(method.config);
    verdict = VerdictOptions::FromYaml(method.config);
  }
  if (!method.method.empty()) odometry.method = MethodFromName(method.method);
  odometry.Check();
  odometry.points.max_points = PointsOfRepeat(odometry.points.max_points, repeat);
  const MappingOptions mapping = ReadMappingOptions(method.config);
  return odometry.ToYaml() + verdict.ToYaml() + mapping.ToYaml();
}

// True where a stage has left a whole result: of a map also one that lacks what the recording does
// not show. Throws DataError where its summary is damaged.
bool IsFinished(const std::string& summary) {
  if (!Exists(summary)) return false;
  return ParseJsonFile(summary, [](const Json& json) {
    return json.at("complete").get<bool>() || !json.value("interrupted", true);
  });
}

// True where a stage has left a whole result in a folder, which read() finds to be as it was
// written. Else the folder is removed: a stage would not take what is there for its own.
bool IsKept(const std::string& folder, const char* summary,
            const std::function<void(const std::string&)>& read) {
  try {
    const EndsAtOnce nothing_is_written;
    if (IsFinished(folder + "/" + summary)) {
      read(folder);
      return true;
    }
  } catch (const DataError& error) {
    spdlog::warn("{}: found damaged what was kept from before: made anew", folder);
    spdlog::debug("{}", error.what());
  }
  if (!Exists(folder)) return false;
  // Of a comparison that was killed the stage may be at work still: that is an error.
  const InputLock nobody_writes(folder);
  std::error_code error;
  fs::remove_all(folder, error);  // what stays, the stage says
  return false;
}

bool IsRunKept(const std::string& folder) {
  return IsKept(folder, "run.json", [](const std::string& path) { ReadRunFolder(path); });
}

bool IsMapKept(const std::string& folder) {
  return IsKept(folder, "map.json", [](const std::string& path) { ReadMapFolder(path); });
}

// How far a stage has come by what it last said of it ("odometry  40 %"): a share.
double ShareSaid(const std::string& log_path) {
  std::string text;
  try {
    text = ReadFile(log_path);
  } catch (const DataError&) {
    return 0;  // it was removed: the stage goes on without
  }
  const size_t said = text.rfind(kSaysShare);
  if (said == std::string::npos) return 0;
  return std::strtod(text.c_str() + said + std::strlen(kSaysShare), nullptr) / 100;
}

// Runs a stage; the reason where it has no result.
std::string RunStage(const std::vector<std::string>& arguments, const std::string& summary,
                     const std::string& log_path, const Progress& progress) {
  progress.Report(0);
  const int code = RunSelf(arguments, log_path, [&] { progress.Report(ShareSaid(log_path)); });
  if (Interrupted()) throw StoppedError("interrupted; finished runs are kept");
  if ((code == kExitSuccess || code == kExitFailedRun) && IsFinished(summary)) return "";
  if (code >= kExitSignal) {
    return fmt::format("ended by signal {}; {}", code - kExitSignal, log_path);
  }
  const std::string last = LastLine(log_path);
  return last.empty() ? fmt::format("ended with {}; {}", code, log_path) : last;
}

// Makes a map in a folder unless it is kept; the reason where there is none.
std::string MakeMap(const std::string& folder, std::vector<std::string> arguments, int threads,
                    const Progress& progress) {
  if (IsMapKept(folder)) return "";
  arguments.insert(arguments.begin() + 2, {"-o", folder, "--threads", std::to_string(threads)});
  return RunStage(arguments, folder + "/map.json", folder + ".log", progress);
}

struct Repeat {
  RunFolders folders;
  std::string problem;
};

// Makes the run and the map without images, or says what the problem is.
void MakeRun(const std::string& sequence, const std::string& config, const std::string& folder,
             const RunPlan& plan, const Progress& progress, Repeat* made) {
  const std::string& run = made->folders.run;
  const std::string threads = std::to_string(plan.threads);
  if (IsRunKept(run)) {
    spdlog::info("{}: kept from before", folder);
  } else {
    std::error_code error;
    fs::remove_all(folder + "/map", error);
    std::vector<std::string> arguments = {"odometry", sequence, "-o",        run,
                                          "--config", config,   "--threads", threads};
    arguments.insert(arguments.end(), plan.opened.begin(), plan.opened.end());
    made->problem =
        RunStage(arguments, run + "/run.json", folder + "/odometry.log", progress.Part(0, 0.9));
  }
  if (!made->problem.empty()) return;
  made->problem = MakeMap(made->folders.map, {"map", run, "--sparse", "--config", config},
                          plan.threads, progress.Part(0.9, 1));
}

Repeat RunRepeat(const MethodToRun& method, const std::string& sequence, const std::string& id,
                 const std::string& sequence_name, int repeat, const RunPlan& plan,
                 const Progress& progress) {
  const std::string options = FormatOptions(method, repeat);
  const std::string key =
      Checksum(id + fmt::format("{}", fmt::join(plan.opened, "\n")) + plan.program + options)
          .substr(0, kKeyLength);
  const std::string folder =
      fmt::format("{}/{}/{}-{}-{}", plan.folder, sequence_name, method.name, repeat, key);
  MakeFolder(folder);
  const std::string config = folder + "/options.yaml";
  WriteFile(config, options);
  Repeat made{{folder + "/run", folder + "/map"}, ""};
  MakeRun(sequence, config, folder, plan, progress, &made);
  return made;
}

}  // namespace

std::string SequenceId(const std::string& sequence) {
  const fs::path folder = LocateRecording(sequence);
  std::string text = fs::weakly_canonical(folder).string();
  if (IsBagRecording(sequence)) return text + "\n" + DescribeBag(folder.string());
  for (const char* name : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv", "cam0/sensor.yaml",
                           "cam1/sensor.yaml", "imu0/sensor.yaml"}) {
    std::error_code error;
    if (fs::is_regular_file(folder / name, error)) {
      text += "\n" + Checksum(ReadFile((folder / name).string()));
    }
  }
  for (const char* images : {"cam0/data", "cam1/data"}) {
    text += "\n" + Checksum(DescribeFiles((folder / images).string()));
  }
  return text;
}

void CheckMethod(const MethodToRun& method) { FormatOptions(method, 0); }

int PointsOfRepeat(int max_points, int repeat) {
  // 1, 0.9, 1.1, 0.8, 1.2, ...
  const double change = 0.1 * ((repeat + 1) / 2) * (repeat % 2 == 1 ? -1 : 1);
  return std::max(1, static_cast<int>(std::lround(max_points * (1 + change))));
}

MeasuredMethod RunMethod(const MethodToRun& method, const std::string& sequence,
                         const std::string& sequence_name, const RunPlan& plan,
                         const Progress& progress) {
  MeasuredMethod measured{method.name, {}, {}, {}};
  const std::string id = SequenceId(sequence);
  for (int repeat = 0; repeat < plan.repeats; ++repeat) {
    spdlog::info("{}: {}, run {} of {}", sequence_name, method.name, repeat + 1, plan.repeats);
    const double repeats = plan.repeats;
    const Repeat made = RunRepeat(method, sequence, id, sequence_name, repeat, plan,
                                  progress.Part(repeat / repeats, (repeat + 1) / repeats));
    if (made.problem.empty()) {
      measured.runs.push_back(made.folders);
      continue;
    }
    spdlog::warn("{}: {}: {}", sequence_name, method.name, made.problem);
    measured.remarks.push_back(fmt::format("run {} failed: {}", repeat + 1, made.problem));
  }
  return measured;
}

}  // namespace slcmap::commands
