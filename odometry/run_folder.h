// A run on disk: what odometry found, as documented files that other programs can read too.
// README.md, "Run folder", describes each file.
#pragma once

#include <string>

#include "data/output_folder.h"
#include "odometry/run.h"

namespace slcmap {

// The names of the files of a run.
StageFiles RunFiles();

// Writes a run into a folder, which is made where it is missing; the files of an earlier run are
// replaced once all are written. States and landmarks that are not finite are left out and counted
// among the warnings in run.json. Throws OutputError, naming the file, when something cannot be
// written, and what OutputFolder throws.
void WriteRunFolder(const std::string& folder, const OdometryRun& run);
void WriteRunFolder(OutputFolder* folder, const OdometryRun& run);

// Reads what WriteRunFolder wrote; landmark positions come back rounded to float, pixels to 1e-4.
// Throws DataError, naming file and row, when a file is missing, damaged or of another version.
OdometryRun ReadRunFolder(const std::string& folder);

}  // namespace slcmap
