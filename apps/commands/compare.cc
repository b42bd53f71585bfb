// slcmap compare: methods against each other on the same sequences.
#include <spdlog/fmt/chrono.h>
#include <spdlog/spdlog.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "apps/commands/commands.h"
#include "apps/commands/compare_runs.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "apps/compare/comparison.h"
#include "apps/compare/measure.h"
#include "apps/maps/measured_map.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/version.h"
#include "mapping/external_poses/read_poses.h"
#include "mapping/map/stage_store.h"
#include "odometry/run/run.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> sequences;
  std::string output;
  std::vector<std::string> methods = {"points-mono", "points", "points-lines", "structural", "slc"};
  std::vector<std::string> with;      // NAME=file.tum or NAME@SEQUENCE=file.tum
  std::vector<std::string> variants;  // NAME=file.yaml
  int repeats = 1;
  int threads = 2;
  PoseForm form;              // of the trajectories
  SequenceOptions opened;     // how the sequences are opened
  ExternalMapArguments maps;  // by other systems, instead of sequences
};

struct NamedFile {
  std::string name, path;
};

NamedFile ParseNamedFile(const char* option, const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
    throw ConfigError(fmt::format("{}: found {}, expected NAME=file", option, text));
  }
  NamedFile named{text.substr(0, equals), text.substr(equals + 1)};
  // Names become folders.
  if (named.name.find('/') != std::string::npos || named.name.front() == '.') {
    throw ConfigError(fmt::format("{}: found {}, expected a name without '/'", option, named.name));
  }
  if (!fs::is_regular_file(named.path)) {
    throw ConfigError(fmt::format("{}: found {}, expected a file", option, named.path));
  }
  return named;
}

// The name of a sequence: its folder, or the one above mav0.
std::string SequenceName(const std::string& sequence) {
  const fs::path path = fs::weakly_canonical(sequence);
  return (path.filename() == "mav0" ? path.parent_path() : path).filename().string();
}

std::vector<MethodToRun> MethodsToRun(const CompareArguments& arguments) {
  std::vector<MethodToRun> methods;
  for (const std::string& name : arguments.methods) {
    methods.push_back({name, MethodName(MethodFromName(name)), ""});
  }
  for (const std::string& text : arguments.variants) {
    const NamedFile variant = ParseNamedFile("--variant", text);
    methods.push_back({variant.name, "", variant.path});
  }
  return methods;
}

// The trajectories that were given for one of the sequences.
std::vector<NamedFile> GivenFor(const CompareArguments& arguments, const std::string& sequence) {
  std::vector<NamedFile> given;
  for (const std::string& text : arguments.with) {
    NamedFile named = ParseNamedFile("--with", text);
    const size_t at = named.name.find('@');
    if (at == std::string::npos && arguments.sequences.size() > 1) {
      throw ConfigError(
          fmt::format("--with: found {} and {} sequences, expected NAME@SEQUENCE=file", text,
                      arguments.sequences.size()));
    }
    if (at != std::string::npos) {
      if (named.name.substr(at + 1) != sequence) continue;
      named.name.resize(at);
    }
    given.push_back(named);
  }
  return given;
}

// A name stands for one thing in all tables.
void CheckNames(const CompareArguments& arguments) {
  std::set<std::string> sequences;
  for (const std::string& sequence : arguments.sequences) {
    const std::string name = SequenceName(sequence);
    if (!sequences.insert(name).second) {
      throw ConfigError("sequences: found two of the name " + name + ", expected different names");
    }
    std::set<std::string> names;
    const auto add = [&](const std::string& method) {
      if (!names.insert(method).second) {
        throw ConfigError("methods: found " + method + " twice, expected different names");
      }
    };
    for (const MethodToRun& method : MethodsToRun(arguments)) add(method.name);
    for (const NamedFile& file : GivenFor(arguments, name)) add(file.name);
    if (names.empty()) throw ConfigError("--methods: found none, expected something to compare");
  }
}

// By sequence, with their names.
using GivenTrajectories = std::map<std::string, std::vector<std::pair<std::string, Trajectory>>>;

// In the form that the options say, as far as the images tell.
GivenTrajectories ReadGiven(const CompareArguments& arguments) {
  GivenTrajectories trajectories;
  for (const std::string& sequence : arguments.sequences) {
    for (const NamedFile& file : GivenFor(arguments, SequenceName(sequence))) {
      const ExternalPoses given = ReadExternalPoses(
          file.path, arguments.form, OpenSequence(sequence, arguments.opened), false);
      if (!given.reading.agrees) spdlog::warn("{}: {}", file.path, given.reading.words);
      trajectories[sequence].emplace_back(file.name, given.trajectory);
    }
  }
  return trajectories;
}

// Before the runs that they are compared with.
void CheckGiven(const CompareArguments& arguments) {
  for (const std::string& text : arguments.with) {
    const NamedFile named = ParseNamedFile("--with", text);
    const size_t at = named.name.find('@');
    if (at == std::string::npos) continue;
    const std::string name = named.name.substr(at + 1);
    const bool is_known =
        std::any_of(arguments.sequences.begin(), arguments.sequences.end(),
                    [&](const std::string& path) { return SequenceName(path) == name; });
    if (at > 0 && is_known) continue;
    throw ConfigError(
        fmt::format("--with: found {}, expected NAME@SEQUENCE=file with the name of a sequence "
                    "that is compared",
                    text));
  }
}

void RefuseWrongArguments(const CompareArguments& arguments) {
  if (arguments.repeats < 1 || arguments.repeats > 19) {
    throw ConfigError(fmt::format("--repeats: found {}, expected 1 to 19", arguments.repeats));
  }
  CheckThreads(arguments.threads);
  CheckGiven(arguments);
  CheckNames(arguments);
  for (const MethodToRun& method : MethodsToRun(arguments)) CheckMethod(method);
  for (const std::string& sequence : arguments.sequences) {
    ExpectFolder(sequence, FolderKind::kSequence);
    SequenceId(sequence);
  }
}

MeasuredSequence RunSequence(const CompareArguments& arguments, const std::string& path,
                             GivenTrajectories* given, const std::string& program) {
  MeasuredSequence sequence;
  sequence.name = SequenceName(path);
  sequence.path = path;
  sequence.true_poses = FindTruePoses(path);
  sequence.true_edges = FindTrueEdges(path);
  const RunPlan plan{arguments.output + "/runs", arguments.repeats, arguments.threads, program,
                     SequenceArguments(arguments.opened)};
  const std::vector<MethodToRun> methods = MethodsToRun(arguments);
  const Progress progress = StageProgress(sequence.name + " runs");
  const auto count = static_cast<double>(methods.size());
  for (size_t i = 0; i < methods.size(); ++i) {
    const auto done = static_cast<double>(i);
    sequence.methods.push_back(RunMethod(methods[i], path, sequence.name, plan,
                                         progress.Part(done / count, (done + 1) / count)));
  }
  for (auto& [name, trajectory] : (*given)[path]) {
    sequence.methods.push_back({name, {}, std::move(trajectory), {}});
  }
  const EndsAtOnce only_read;
  sequence.reference = ReferenceAmong(sequence.methods);
  if (!sequence.reference) {
    spdlog::warn("{}: no run has lines, so straightness is not measured", sequence.name);
  }
  return sequence;
}

std::string Today() { return fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr))); }

// The processor, as Linux names it, and how many of them.
std::string MachineName() {
  std::ifstream cpus("/proc/cpuinfo");
  std::string name;
  for (std::string line; name.empty() && std::getline(cpus, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) name = line.substr(colon + 2);
  }
  utsname system{};
  if (name.empty() && uname(&system) == 0) name = system.machine;
  return fmt::format("{} x {}", std::max(1u, std::thread::hardware_concurrency()), name);
}

// As a shell takes it.
std::string Quoted(const std::string& text) {
  const bool is_plain = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string("/._-=@,:+").find(c) != std::string::npos;
  });
  if (is_plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// As it can be typed again in the same folder.
std::string FormatCommand(const CompareArguments& arguments) {
  std::string command = "slcmap compare";
  for (const std::string& sequence : arguments.sequences) command += " " + Quoted(sequence);
  command += " -o " + Quoted(arguments.output);
  command +=
      fmt::format(" --methods {}", Quoted(fmt::format("{}", fmt::join(arguments.methods, ","))));
  if (arguments.repeats > 1) command += fmt::format(" --repeats {}", arguments.repeats);
  command += fmt::format(" --threads {}", arguments.threads);
  for (const std::string& opened : SequenceArguments(arguments.opened)) {
    command += " " + Quoted(opened);
  }
  for (const std::string& with : arguments.with) command += " --with " + Quoted(with);
  const std::string form = FormatOptions(arguments.form);
  if (!form.empty()) command += " " + form;
  for (const std::string& variant : arguments.variants) command += " --variant " + Quoted(variant);
  return command;
}

void WriteReport(const Comparison& comparison, OutputFolder* output) {
  const std::string& folder = output->staging();
  WriteFile(folder + "/compare.csv", ComparisonCsv(comparison));
  WriteFile(folder + "/report.html", ComparisonPage(comparison));
  WriteJsonFile(folder + "/compare.json", ComparisonJson(comparison));
  output->Commit();
}

// The report tells what went wrong; a script should learn of it too.
void RefuseEmpty(const std::string& output, const Comparison& comparison) {
  for (const SequenceResult& sequence : comparison.sequences) {
    for (const MethodResult& method : sequence.methods) {
      if (!method.repeats.empty()) return;
    }
  }
  throw DataError(output + ": no method gave a result; the logs in its folder runs say why");
}

void Compare(const CompareArguments& arguments) {
  GivenTrajectories given;
  {
    const EndsAtOnce nothing_is_written;
    RefuseWrongArguments(arguments);
    given = ReadGiven(arguments);
  }
  std::vector<std::string> inputs;
  for (const std::string& sequence : arguments.sequences) {
    for (std::string& folder : ListFolders(sequence)) inputs.push_back(std::move(folder));
  }
  for (const std::string& file : CollectFiles(arguments.opened)) inputs.push_back(file);
  RefuseInputs(arguments.output, inputs);
  OutputFolder output(arguments.output,
                      {"a comparison", {"compare.json", "compare.csv", "report.html"}}, inputs);
  output.Open();
  const std::string program = ProgramId();
  Comparison comparison;
  comparison.version = kVersion;
  comparison.date = Today();
  comparison.machine = MachineName();
  comparison.command = FormatCommand(arguments);
  comparison.repeats = arguments.repeats;
  for (const std::string& path : arguments.sequences) {
    const MeasuredSequence sequence = RunSequence(arguments, path, &given, program);
    const Progress progress = StageProgress(sequence.name + " measures");
    const EndsAtOnce nothing_is_written;  // finished runs are kept
    comparison.sequences.push_back(MeasureSequence(sequence, progress));
  }
  WriteReport(comparison, &output);
  std::fputs(ComparisonTable(comparison).c_str(), stdout);
  std::printf("\nresults   %s/compare.json, compare.csv\nopen      %s/report.html\n",
              arguments.output.c_str(), arguments.output.c_str());
  RefuseEmpty(arguments.output, comparison);
}

// Maps by any system instead of methods on sequences.
void CompareMaps(const CompareArguments& arguments) {
  const EndsAtOnce only_read;
  const MapsToMeasure maps = CollectMaps(arguments.maps);
  const std::vector<std::string> inputs = CollectFiles(maps);
  RefuseInputs(arguments.output, inputs);
  OutputFolder output(arguments.output, {"a comparison of maps", {"maps.json", "maps.csv"}},
                      inputs);
  output.Open();
  const MapMeasures measured = MeasureMaps(maps, StageProgress("maps"));
  const std::string& folder = output.staging();
  WriteFile(folder + "/maps.csv", MapCsv(measured.maps));
  Json json = {{"format", "slcmap comparison of maps"}};
  json.update(MapsJson(measured.maps));
  WriteJsonFile(folder + "/maps.json", json);
  output.Commit();
  std::fputs(MapTable(measured.maps).c_str(), stdout);
  std::printf("\nresults   %s/maps.json, maps.csv\n", arguments.output.c_str());
  if (!measured.failures.empty()) throw DataError(measured.failures);
}

}  // namespace

void AddCompareCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("compare", "Compare methods on sequences, with one report of them");
  const auto arguments = std::make_shared<CompareArguments>();
  CLI::Option* sequences =
      command
          ->add_option("sequences", arguments->sequences,
                       "EuRoC (ASL) or TUM VI folders, or bags, with or without true poses")
          ->type_name("SEQ");
  CLI::Option* maps = AddExternalMapOptions(*command, &arguments->maps);
  maps->excludes(sequences);
  command
      ->add_option("-o,--output", arguments->output,
                   "Folder for the report; finished runs are kept in its folder runs, and not made "
                   "again")
      ->type_name("REPORT")
      ->required();
  command->add_option("--methods", arguments->methods, "Methods to run, separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option(
      "--with", arguments->with,
      "NAME=file: the trajectory of another system (TUM or EuRoC file, poses of the "
      "IMU); of several sequences NAME@SEQUENCE=file");
  AddSequenceOptions(*command, &arguments->opened);
  AddPoseOptions(*command, &arguments->form);
  command->add_option("--variant", arguments->variants,
                      "NAME=file.yaml: the options of that file as one more method");
  command
      ->add_option("--repeats", arguments->repeats,
                   "Runs of each method, with 10 % fewer or more points each, to know the spread")
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Threads of each run")
      ->capture_default_str();
  command->footer(
      "Examples:\n  slcmap compare MH_01_easy V1_01_easy -o report --repeats 3\n"
      "  slcmap compare SEQ -o report --methods points,slc --with orbslam=poses.tum\n"
      "  slcmap compare --maps ours=MAP other=other.ply limap=FOLDER --true-map scan.las -o "
      "report\n\n"
      "All are measured with the same observations. Without true poses what needs none is "
      "measured,\n"
      "and the report says which that is.");
  command->callback([=] {
    if (maps->count() > 0) return CompareMaps(*arguments);
    if (sequences->count() == 0) throw CLI::RequiredError("sequences");
    Compare(*arguments);
  });
}

}  // namespace slcmap::commands
