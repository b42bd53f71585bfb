// slcmap batch: many recordings of buildings, each mapped, then merged and exported, by Snakemake.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "apps/batch/workflow.h"
#include "apps/commands/child_process.h"
#include "apps/commands/commands.h"
#include "apps/commands/compare_runs.h"
#include "apps/commands/export.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/progress.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/source/sequence_options_json.h"
#include "data/version.h"
#include "export/export.h"
#include "mapping/map/names.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

struct BatchArguments {
  std::string site;    // a file; with status or job, a site's folder
  std::string output;  // folder
  std::string profile, job;
  int threads = 2;  // of a job
  bool status = false, dry_run = false;
};

void CheckSiteOptions(const Site& site) {
  CheckMethod({"", site.method, site.config});
  if (!site.names.empty()) ReadNames(site.names);
  ExportOptions exporting;
  exporting.formats = site.exports;
  if (std::erase(exporting.formats, kPageFormat) > 0) ReadPageTemplate();
  if (!exporting.formats.empty()) CheckFormats(exporting);
}

// A folder of its own, and none that is read.
void CheckSiteFolder(const std::string& folder, const std::string& file, const Site& site) {
  std::vector<std::string> inputs = {file};
  for (const SiteRecording& recording : site.recordings) {
    for (std::string& path : ListFolders(recording.path)) inputs.push_back(std::move(path));
  }
  RefuseInputs(folder, inputs);
  std::error_code error;
  if (!fs::exists(folder, error) || fs::exists(folder + "/" + kWorkflowFile, error)) return;
  if (fs::is_directory(folder, error) && fs::is_empty(folder, error)) return;
  throw ConfigError(fmt::format(
      "output {}: found something that is no site's folder, expected a new or empty one", folder));
}

// Calibrations lie in these beside a recording: sensor.yaml files are in SequenceId.
std::string ChecksumOfCalibrations(const SiteRecording& recording) {
  const fs::path asl = LocateRecording(recording.path);
  std::vector<fs::path> folders = {asl, asl.parent_path(), asl.parent_path() / "dso"};
  const std::string& given = recording.opened.calibration;
  if (!given.empty()) {
    const std::vector<std::string> paths = SplitCalibrationPaths(given);
    folders.assign(paths.begin(), paths.end());
  }
  std::vector<std::string> files;
  std::error_code error;
  for (const fs::path& folder : folders) {
    if (fs::is_regular_file(folder, error)) files.push_back(folder.string());
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      if (it->path().extension() == ".yaml") files.push_back(it->path().string());
    }
  }
  std::ranges::sort(files);
  RunningChecksum checksum;
  for (const std::string& file : files) checksum.Add(ReadFile(file));
  return checksum.Text();
}

// All that decides what a recording's map is, and behind a space what its place is.
std::string RecordingKey(const SiteRecording& recording, const Site& site,
                         const std::string& config) {
  return Checksum(fmt::format("{}\n{}\n{}\n{}\n{}\n{}", kVersion, SequenceId(recording.path),
                              OpenedJson(recording.opened).dump(),
                              ChecksumOfCalibrations(recording), site.method, config)) +
         " " + Checksum(DescribeControl(site, recording.building));
}

// Jobs find the configuration as it was when they were planned.
Workflow PlanSite(const std::string& folder, Site site) {
  Workflow workflow;
  workflow.program = fs::read_symlink("/proc/self/exe").string();
  const std::string config = site.config.empty() ? "" : ReadFile(site.config);
  std::error_code error;
  fs::remove(folder + "/" + kOptionsFile, error);
  if (!site.config.empty()) {
    WriteFile(folder + "/" + kOptionsFile, config);
    site.config = kOptionsFile;
  }
  workflow.jobs = PlanJobs(site);
  workflow.site = std::move(site);
  const Progress progress = StageProgress("recordings");
  for (Job& job : workflow.jobs) {
    if (!IsRecordingJob(job)) continue;
    const SiteRecording& recording = workflow.FindRecording(RecordingName(job));
    progress.Report(static_cast<double>(&recording - workflow.site.recordings.data()) /
                    static_cast<double>(workflow.site.recordings.size()));
    job.key = RecordingKey(recording, workflow.site, config);
  }
  return workflow;
}

std::string MarkPath(const std::string& folder, const std::string& job) {
  return fmt::format("{}/{}/{}", folder, kMarksFolder, job);
}

std::string JobLog(const std::string& folder, const std::string& job) {
  return fmt::format("{}/workflow/log/{}.log", folder, job);
}

bool HasMark(const std::string& folder, const std::string& job) {
  return Exists(MarkPath(folder, job));
}

// Snakemake does what has no mark, and what comes behind that. Returns how many jobs are to be
// done.
int MarkWhatIsDone(const std::string& folder, const Workflow& workflow) {
  int left = 0;
  for (const Job& job : workflow.jobs) {
    std::error_code error;
    const bool is_behind = std::ranges::any_of(
        job.after, [&](const std::string& before) { return !HasMark(folder, before); });
    if (!is_behind && IsCurrent(folder, workflow, job)) {
      if (!HasMark(folder, job.name)) WriteFile(MarkPath(folder, job.name), "");
      continue;
    }
    ++left;
    fs::remove(MarkPath(folder, job.name), error);
    fs::remove(JobLog(folder, job.name), error);
  }
  return left;
}

double ShareDone(const std::string& folder, const Workflow& workflow) {
  const auto done = std::ranges::count_if(
      workflow.jobs, [&](const Job& job) { return HasMark(folder, job.name); });
  return static_cast<double>(done) / static_cast<double>(workflow.jobs.size());
}

// One of those that slcmap comes with by its name; others as Snakemake finds them.
std::string FindProfile(const std::string& profile) {
  const bool is_name = profile.find('/') == profile.npos;
  const std::string own = ConfigFolder() + "/batch/" + profile;
  return is_name && fs::is_directory(own) ? own : profile;
}

int64_t MemoryOfMachine_mb() {
  return sysconf(_SC_PHYS_PAGES) / 1024 * (sysconf(_SC_PAGE_SIZE) / 1024);
}

std::vector<std::string> SnakemakeArguments(const std::string& folder,
                                            const BatchArguments& arguments) {
  constexpr int64_t kMostOfJob_mb = 4000;  // by the Snakefile: with less, one at a time is tried
  std::vector<std::string> all = {"--snakefile", folder + "/workflow/Snakefile", "--configfile",
                                  folder + "/" + kWorkflowFile, "--directory", folder,
                                  "--keep-going", "--rerun-incomplete", "--rerun-triggers", "mtime",
                                  "--latency-wait", "30",
                                  // The folder's turn is taken; Snakemake's own lock would stay
                                  // behind where it is killed.
                                  "--nolock"};
  if (arguments.dry_run) all.insert(all.end(), {"--dry-run", "--quiet", "progress"});
  if (!arguments.profile.empty()) {
    all.insert(all.end(), {"--profile", FindProfile(arguments.profile)});
    return all;
  }
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  all.insert(all.end(), {"--cores", std::to_string(cores), "--resources",
                         fmt::format("mem_mb={}", std::max(kMostOfJob_mb, MemoryOfMachine_mb()))});
  return all;
}

int RunSnakemake(const std::string& folder, const Workflow& workflow,
                 const BatchArguments& arguments) {
  ProgressBar bar("batch");
  ChildProcess child{"snakemake", SnakemakeArguments(folder, arguments), "", {}, true};
  if (!arguments.dry_run) {
    child.log_path = folder + "/workflow/snakemake.log";
    child.watch = [&] { bar.Update(ShareDone(folder, workflow)); };
  }
  try {
    return RunChild(child);
  } catch (const OutputError& error) {
    throw ConfigError(
        fmt::format("{}; expected Snakemake 7 on this machine (Debian: apt-get install snakemake)",
                    error.what()));
  }
}

// Jobs that were started, and ended without a result, as for their memory: those behind them go on
// with what there is. False where there are none.
bool GiveUpKilledJobs(const std::string& folder, const Workflow& workflow) {
  bool is_any = false;
  for (const Job& job : workflow.jobs) {
    const std::string log = JobLog(folder, job.name);
    if (HasMark(folder, job.name) || !Exists(log)) continue;
    const std::string last = LastLine(log);
    JobResult result;
    result.reason = "its job ended without a result" + (last.empty() ? "" : ": " + last);
    result.remedy = "more memory or time, see " + log + "; run the site again to try again";
    result.key = ComputeJobKey(folder, workflow, job);
    WriteJobResult(folder + "/" + job.name, result);
    WriteFile(MarkPath(folder, job.name), "");
    is_any = true;
  }
  return is_any;
}

void RunJobs(const std::string& folder, const Workflow& workflow, const BatchArguments& arguments) {
  while (RunSnakemake(folder, workflow, arguments) != 0) {
    if (Interrupted() || arguments.dry_run) return;
    if (GiveUpKilledJobs(folder, workflow)) continue;
    throw DataError(fmt::format("snakemake failed: {}; see {}/workflow/snakemake.log",
                                LastLine(folder + "/workflow/snakemake.log"), folder));
  }
}

void TellStatus(const std::string& folder, const Workflow& workflow) {
  const SiteStatus status = ReadStatus(folder, workflow);
  ReplaceFile(folder + "/status.json", StatusJson(status));
  ReplaceFile(folder + "/status.html", StatusPage(status));
  std::fputs(StatusTable(status).c_str(), stdout);
  std::fflush(stdout);
  const std::string failures = status.Failures();
  if (!failures.empty() && !Interrupted()) throw DataError(folder + ": " + failures);
}

void RunSite(const BatchArguments& arguments) {
  if (arguments.output.empty()) throw ConfigError("batch: found no --output, expected one");
  const Site site = ReadSite(arguments.site);
  CheckSiteOptions(site);
  CheckSiteFolder(arguments.output, arguments.site, site);
  for (const char* kind : {kRecordingJobs, kPlaceJobs, kMergeJobs, kExportJobs}) {
    MakeFolder(MarkPath(arguments.output, kind));
    MakeFolder(fmt::format("{}/workflow/log/{}", arguments.output, kind));
  }
  const std::string folder = fs::weakly_canonical(arguments.output).string();
  FolderTurn turn(folder + "/workflow");
  if (!turn.Take()) {
    throw OutputError(arguments.output +
                      ": in use: another slcmap batch, or jobs of one that was "
                      "killed, are at work in it");
  }
  const Workflow workflow = PlanSite(folder, site);
  WriteWorkflow(folder, workflow);
  for (const char* name : {"Snakefile", "job.sh"}) {
    ReplaceFile(fmt::format("{}/workflow/{}", folder, name),
                ReadFile(fmt::format("{}/batch/{}", ConfigFolder(), name)));
  }
  const int left = MarkWhatIsDone(folder, workflow);
  spdlog::info("{}: {} recordings, {} of {} jobs are to be done", arguments.output,
               site.recordings.size(), left, workflow.jobs.size());
  if (left > 0 || arguments.dry_run) RunJobs(folder, workflow, arguments);
  if (!arguments.dry_run) TellStatus(arguments.output, workflow);
}

void RunBatch(const BatchArguments& arguments) {
  if (!arguments.job.empty()) return RunSiteJob(arguments.site, arguments.job, arguments.threads);
  if (!arguments.status) return RunSite(arguments);
  const std::string& folder = arguments.output.empty() ? arguments.site : arguments.output;
  if (!Exists(folder + "/" + kWorkflowFile)) {
    throw ConfigError(fmt::format(
        "batch --status: found no {} in {}, expected the folder of a site that batch has begun",
        kWorkflowFile, folder));
  }
  TellStatus(folder, ReadWorkflow(folder));
}

}  // namespace

void AddBatchCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("batch", "Map many recordings of buildings, merge and export them");
  const auto arguments = std::make_shared<BatchArguments>();
  command
      ->add_option(
          "site", arguments->site,
          "Site file: recordings, options, exports, plans; with --status alone, a site's folder")
      ->type_name("SITE.yaml")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder of the site")->type_name("SITE");
  command
      ->add_option("--profile", arguments->profile,
                   "Where jobs run: slurm, or a profile of Snakemake 7 (default: this machine)")
      ->type_name("NAME|DIR");
  command->add_flag("-n,--dry-run", arguments->dry_run, "Tell which jobs would run");
  command->add_flag("--status", arguments->status, "Tell how far a site has come, now");
  command->add_option("--job", arguments->job, "Do one job of a site, as Snakemake asks for it")
      ->group("");
  command->add_option("--threads", arguments->threads, "Of that job")->group("");
  command->footer(
      "Examples:\n  slcmap batch site.yaml -o SITE\n"
      "  slcmap batch site.yaml -o SITE --profile slurm\n"
      "  slcmap batch SITE --status\n\n"
      "The same command again goes on: what is done is kept, what failed is tried again, and what\n"
      "was changed is done anew. Maps that do not fit to each other stay apart. SITE/status.html\n"
      "and status.json tell the state of each recording, and the exit code is 1 where one failed.");
  command->callback([arguments] { RunBatch(*arguments); });
}

}  // namespace slcmap::commands
