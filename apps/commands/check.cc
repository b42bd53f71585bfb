// slcmap check: what is wrong with a recorded sequence, and what to do about it.
#include "data/check/check.h"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/convert.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline commands {
namespace {

struct CheckArguments {
  std::string sequence;
  SequenceOptions options;
  bool json = false;
};

void Check(const CheckArguments& arguments) {
  RefuseVideo(arguments.sequence);
  const Progress progress = StageProgress("check");  // shown or not by the user's level
  // The report names each kind of damage; the readers need not say it too.
  const auto level = spdlog::get_level();
  spdlog::set_level(spdlog::level::err);
  const CheckReport report = CheckSequence(arguments.sequence, arguments.options, progress);
  spdlog::set_level(level);
  std::fputs(arguments.json ? CheckJson(report).c_str() : CheckTable(report).c_str(), stdout);
  if (report.Usable()) return;
  std::fflush(stdout);
  throw DataError(arguments.sequence + ": not usable, see the report");
}

}  // namespace

void AddCheckCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("check", "Check a recorded sequence, naming remedies");
  const auto arguments = std::make_shared<CheckArguments>();
  command
      ->add_option(
          "sequence", arguments->sequence,
          "EuRoC (ASL) or TUM VI folder: the one with cam0, cam1, imu0, or the one above; or "
          "a bag, whose topics are listed")
      ->required();
  AddSequenceOptions(*command, &arguments->options);
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->footer(
      "Examples:\n  slcmap check MH_01_easy\n  slcmap check recording --json > check.json\n\n"
      "Exits with 0 if the sequence can be used, else with 1.");
  command->callback([arguments] { Check(*arguments); });
}

namespace {

// Leaves out of the sequence what moves with the rig.
CheckReport Check(bool one_camera, Sequence* sequence) {
  Sequence checked = one_camera ? *sequence : SelectPairs(*sequence);
  if (one_camera) checked.rig.Resize(1);
  RecordedSource source(checked);
  CheckReport report = CheckStart(&source, sequence->imu, StageProgress("check"));
  sequence->rig.masks = source.info().rig.masks;
  return report;
}

void LogFindings(const CheckReport& report) {
  for (const CheckFinding& finding : report.findings) {
    const auto level =
        finding.severity == Severity::kNote ? spdlog::level::info : spdlog::level::warn;
    spdlog::log(level, "check: {}: {}; remedy: {}", finding.name, finding.found, finding.remedy);
  }
}

void RefuseErrors(const CheckReport& report) {
  for (const CheckFinding& finding : report.findings) {
    if (finding.severity != Severity::kError) continue;
    throw DataError(fmt::format(
        "{}: {}: {}; remedy: {} (--force goes on all the same, --no-check does not look)",
        report.sequence, finding.name, finding.found, finding.remedy));
  }
}

bool IsEstimated(const CheckCorrection& correction, const CalibrationOptions& options) {
  if (correction.name == kTimeOffsetCorrection) return options.time_offset;
  return correction.name == kRightTurnCorrection ? options.right_rotation : options.focal_length;
}

}  // namespace

void LeaveOutHeld(const CalibrationOptions& options, CheckReport* report) {
  std::erase_if(report->corrections, [&](const CheckCorrection& correction) {
    if (IsEstimated(correction, options)) return false;
    spdlog::warn("the check found {}; it is not used, as options hold it", correction.words);
    return true;
  });
}

StartCheck CheckBeforeStart(const StartCheckArguments& arguments, const OdometryOptions& options,
                            Sequence* sequence) {
  if (!arguments.check) return {};
  CheckReport mended;
  const bool uses_right = UsesRight(options.method, sequence->rig);
  if (uses_right) MendIntervals(sequence, {}, &mended);
  LogFindings(mended);
  CheckReport report = Check(!UsesTwoCameras(options.method, sequence->rig), sequence);
  LeaveOutHeld(options.calibration, &report);
  if (!arguments.force) RefuseErrors(report);
  LogFindings(report);
  StartCheck done{report.corrections, {}};
  done.corrections.insert(done.corrections.end(), mended.corrections.begin(),
                          mended.corrections.end());
  for (const CheckFinding& finding : mended.findings) {
    done.errors.push_back(finding.name + ": " + finding.found + "; remedy: " + finding.remedy);
  }
  for (const CheckFinding& finding : report.findings) {
    if (finding.severity != Severity::kError) continue;
    done.errors.push_back(finding.name + ": " + finding.found + "; remedy: " + finding.remedy);
  }
  std::string words;
  for (const CheckCorrection& correction : report.corrections) {
    words += (words.empty() ? "" : ", ") + correction.words;
  }
  if (!words.empty()) spdlog::info("starts from what the check found: {}", words);
  sequence->rig = Corrected(sequence->rig, report);
  return done;
}

void LogVerdict(const std::string& place, const Verdict& verdict) {
  const bool good = verdict.level == VerdictLevel::kGood;
  spdlog::log(good ? spdlog::level::info : spdlog::level::warn, "{}: verdict: {}", place,
              VerdictLevelName(verdict.level));
  for (const VerdictReason& reason : verdict.reasons) {
    const bool remark = reason.level == VerdictLevel::kGood;
    spdlog::log(remark ? spdlog::level::info : spdlog::level::warn, "{}: {}",
                VerdictLevelName(reason.level), InWords(reason));
  }
}

void PrintVerdict(const Verdict& verdict) {
  std::printf("verdict   %s\n", VerdictLevelName(verdict.level).c_str());
  for (const VerdictReason& reason : verdict.reasons) {
    std::printf("          %s: %s\n", VerdictLevelName(reason.level).c_str(),
                InWords(reason).c_str());
  }
}

void RefuseFailed(const std::string& place, const OdometryRun& run) {
  if (!run.complete || !run.verdict || run.verdict->level != VerdictLevel::kFailed) return;
  throw FailedRunError(place + ": the run has failed: " + InWords(run.verdict->reasons.front()));
}

}  // namespace slcmap::commands
