// The odometry stage as commands run it: a sequence on disk in, which is checked before, a run
// folder out, and what is said of the run: its verdict.
#pragma once

#include <functional>
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

// The odometry stage as commands run it: a sequence on disk in, a run folder out.

struct OdometryArguments {
  std::string sequence;
  std::string run;                // folder that is written
  std::string method;             // "" takes the configuration's
  std::string config;             // YAML; "" takes the defaults
  SequenceOptions opened;         // how the sequence is opened
  std::string write_calibration;  // file for what was found of it; "" for none
  SequencePart part;              // of the sequence
  int threads = 2;                // the results are the same with any
  bool real_time = false;         // plays the recording at its own pace, and skips what is late
  StartCheckArguments start;
};

// The folders of a sequence that nothing is to be written into.
std::vector<std::string> ListFolders(const std::string& sequence);

// These, and the files that are read beside them.
std::vector<std::string> ListInputs(const OdometryArguments& arguments);

// Checks a sequence (see CheckBeforeStart) and runs odometry over it. What an earlier run left in
// the folder is moved aside within it when the new run begins, and removed once that is complete.
// `begin` is called then: all is accepted, and nothing computed.
// trajectory.tum grows with each image; a run folder without run.json is unfinished. After Ctrl-C
// the run so far is written and returned with complete == false. After an error the run so far is
// written, and the error thrown on. The verdict is logged; throws FailedRunError when no pose could
// be estimated, and what OutputFolder throws.
OdometryRun RunOdometryStage(const OdometryArguments& arguments,
                             const std::function<void()>& begin = {});

}  // namespace slcmap::commands
