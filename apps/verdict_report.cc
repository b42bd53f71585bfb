#include "apps/verdict_report.h"

#include <spdlog/spdlog.h>

#include <cstdio>

namespace slcmap {

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

}  // namespace slcmap
