#include "apps/start_check.h"

#include <spdlog/spdlog.h>

#include <vector>

#include "apps/progress.h"
#include "data/check/check.h"
#include "data/check/stretches.h"
#include "data/error.h"
#include "data/source/asl_source.h"

namespace slcmap {
namespace {

// Leaves out of the sequence what moves with the rig.
CheckReport Check(bool one_camera, Sequence* sequence) {
  Sequence checked = one_camera ? *sequence : PairsOf(*sequence);
  if (one_camera) checked.rig.cameras[1] = Camera();
  AslSource source(checked);
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
  if (options.method != Method::kPointsMono) MendStretches(sequence, {}, &mended);
  LogFindings(mended);
  CheckReport report = Check(options.method == Method::kPointsMono, sequence);
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

}  // namespace slcmap
