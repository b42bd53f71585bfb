// The runs of a comparison: made once, and kept for the next time.
#pragma once

#include <string>
#include <vector>

#include "apps/compare/measure.h"
#include "data/core/progress.h"

namespace slcmap::inline commands {

// A method of slcmap, or a setting of one.
struct MethodToRun {
  std::string name;
  std::string method;  // "" takes the configuration's
  std::string config;  // YAML; "" takes the defaults
};

struct RunPlan {
  std::string folder;  // that keeps the runs
  int repeats = 1;
  int threads = 2;
  std::string program;              // see ProgramId
  std::vector<std::string> opened;  // arguments that say how sequences are opened
};

// What tells a recording from another: its path, tables, calibration and images, these by names,
// sizes and times of their last change. Throws DataError where it is none.
std::string SequenceId(const std::string& sequence);

// Throws ConfigError where the options of a method cannot be used.
void CheckMethod(const MethodToRun& method);

// A number of points for a repeat, around the one asked for: the same run again would be the same
// to the byte, and tell nothing of how results scatter.
int PointsOfRepeat(int max_points, int repeat);

// Runs odometry and the map of each repeat, each in a process of its own, unless they were finished
// before with the same options by the same program from the same recording; what was, and cannot be
// read any more, is made anew, with a warning. What failed is a remark and not a run. Throws
// StoppedError after Ctrl-C.
MeasuredMethod RunMethod(const MethodToRun& method, const std::string& sequence,
                         const std::string& sequence_name, const RunPlan& plan,
                         const Progress& progress = {});

}  // namespace slcmap::commands
