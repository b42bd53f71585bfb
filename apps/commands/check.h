// The check before a run starts, and what is said of a run afterwards: its verdict.
#pragma once

#include <string>
#include <vector>

#include "data/check/report.h"
#include "data/core/error.h"
#include "data/core/verdict.h"
#include "data/source/sequence.h"
#include "odometry/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline commands {

struct StartCheckArguments {
  bool check = true;   // false: start as calibrated
  bool force = false;  // true: go on in spite of errors
};

struct StartCheck {
  std::vector<CheckCorrection> corrections;  // that were made
  std::vector<std::string> errors;           // that it goes on in spite of, in words
};

// Checks IMU, calibration and geometry of a sequence, logs what was found, and corrects the
// sequence's rig by what odometry had better start from. What the options do not let odometry
// estimate stays as it is, and so does the right camera where its method needs one alone. Throws
// DataError where the check finds an error, unless forced.
StartCheck CheckBeforeStart(const StartCheckArguments& arguments, const OdometryOptions& options,
                            Sequence* sequence);

// Takes out, with a word, the corrections of what options do not let odometry estimate.
void LeaveOutHeld(const CalibrationOptions& options, CheckReport* report);

// How commands tell the verdict on a run.

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

}  // namespace slcmap::commands
