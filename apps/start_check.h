// What odometry does before it starts: the quick part of check.
#pragma once

#include <vector>

#include "data/check/report.h"
#include "data/sequence.h"

namespace slcmap {

struct StartCheckArguments {
  bool check = true;   // false: start as calibrated
  bool force = false;  // true: go on in spite of errors
};

// Checks IMU, calibration and geometry of a sequence, logs what was found, and corrects the
// sequence's rig by what odometry had better start from, which is returned. With `one_camera` the
// right one is left alone. Throws DataError where the check finds an error, unless forced.
std::vector<CheckCorrection> CheckBeforeStart(const StartCheckArguments& arguments, bool one_camera,
                                              Sequence* sequence);

}  // namespace slcmap
