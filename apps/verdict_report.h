// How commands tell the verdict on a run.
#pragma once

#include <string>

#include "data/error.h"
#include "data/verdict.h"
#include "odometry/run.h"

namespace slcmap {

// The exit code of a run whose verdict is `failed`, beside those of commands.h; all is written.
inline constexpr int kExitFailedRun = 3;

// A run that is done, written, and not to be believed.
class FailedRunError : public Error {
 public:
  using Error::Error;
};

// For the help of commands that end with it.
inline constexpr const char* kVerdictHelp =
    "The verdict on the run, good, doubtful or failed, is told at the end with its reasons and\n"
    "remedies, and stands in run.json and map.json. Of a failed run all is written; then the exit\n"
    "code is 3.";

// A line, and one for each reason: warnings where the run is not good. `place` is its folder.
void LogVerdict(const std::string& place, const Verdict& verdict);

// The same on standard output, at the end of `run`.
void PrintVerdict(const Verdict& verdict);

// Throws FailedRunError with the worst reason where the verdict is `failed` and nobody has ended
// the run.
void RefuseFailed(const std::string& place, const OdometryRun& run);

}  // namespace slcmap
