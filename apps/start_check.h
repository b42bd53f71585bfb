// What odometry does before it starts: the quick part of check.
#pragma once

#include <string>
#include <vector>

#include "data/check/report.h"
#include "data/sequence.h"
#include "odometry/options.h"

namespace slcmap {

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

}  // namespace slcmap
