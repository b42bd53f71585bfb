// The files of a run folder that hold lines: lines.ply, lines.csv, line_observations.csv and
// line_points.csv. README.md, "Run folder", describes each.
#pragma once

#include <string>

#include "odometry/run.h"

namespace slcmap {

// Throws OutputError, naming the file, when one cannot be written.
void WriteLineFiles(const std::string& folder, const OdometryRun& run);

// Fills the run's lines, and those of its keyframes; keyframes and Manhattan worlds must be there.
// Reads lines.csv, not lines.ply, which is for other programs and rounded. Throws DataError, naming
// file and row, when a file is missing, damaged, or refers to a keyframe, line or world that there
// is not.
void ReadLineFiles(const std::string& folder, OdometryRun* run);

}  // namespace slcmap
