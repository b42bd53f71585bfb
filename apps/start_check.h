// What odometry does before it starts: the quick part of check.
#pragma once

#include <string>
#include <vector>

#include "data/check/report.h"
#include "data/sequence.h"

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
// sequence's rig by what odometry had better start from. With `one_camera` the right one is left
// alone. Throws DataError where the check finds an error, unless forced.
StartCheck CheckBeforeStart(const StartCheckArguments& arguments, bool one_camera,
                            Sequence* sequence);

}  // namespace slcmap
