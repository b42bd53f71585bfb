// A run on disk: what odometry found, as documented files that other programs can read too.
// odometry/FORMAT.md describes each file.
#pragma once

#include <string>

#include "data/io/output_folder.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// The names of the files of a run.
StageFiles RunFiles();

// Writes a run into a folder, which is made where it is missing; the files of an earlier run are
// replaced once all are written. States and landmarks that are not finite, or absurdly far away,
// are left out and counted among the warnings in run.json. Throws OutputError, naming the file,
// when something cannot be written, and what OutputFolder throws.
void WriteRunFolder(const std::string& folder, const OdometryRun& run);
void WriteRunFolder(OutputFolder* folder, const OdometryRun& run);

// How folders of runs and maps are read.
struct FolderReadOptions {
  bool accept_changed = false;  // files that are not as they were written, as far as they are valid
};

// Reads what WriteRunFolder wrote; landmark positions come back rounded to float, pixels to 1e-4.
// Of a run that was cut off, what its journal holds, as a partial one. Where changes are accepted,
// what nothing depends on, timings.json, is left out with a warning where it is damaged. Throws
// DataError, naming file and row, what was found and what was expected, when a file is missing,
// damaged, changed or of another version.
OdometryRun ReadRunFolder(const std::string& folder, const FolderReadOptions& options = {});

// The id of the finished run in a folder; "" where there is none that says so.
std::string RunIdIn(const std::string& folder);

}  // namespace slcmap::odometry
