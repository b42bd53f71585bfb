// The odometry stage as commands run it: a sequence on disk in, a run folder out.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/commands/check.h"
#include "data/io/output_folder.h"
#include "data/source/sequence.h"
#include "odometry/run/run.h"

namespace slcmap::inline commands {

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
