// The odometry stage as commands run it: a sequence on disk in, a run folder out.
#pragma once

#include <string>

#include "odometry/run.h"

namespace slcmap {

struct OdometryArguments {
  std::string sequence;
  std::string run;          // folder that is written
  std::string method;       // "" takes the configuration's
  std::string config;       // YAML; "" takes the defaults
  std::string calibration;  // "" takes the sequence's
  int threads = 2;          // the results are the same with any
  bool real_time = false;   // plays the recording at its own pace, and skips what is late
};

// Runs odometry over a sequence. The run folder says from the start that it is partial, until it is
// complete; trajectory.tum grows with each image. After Ctrl-C the run so far is written and
// returned with complete == false. After an error the run so far is written, and the error thrown
// on. Throws DataError when no pose could be estimated.
OdometryRun RunOdometryStage(const OdometryArguments& arguments);

}  // namespace slcmap
