// The files that say where a run came from: raw_rig.json, options.yaml and images.csv.
#pragma once

#include <string>
#include <vector>

#include "odometry/run.h"

namespace slcmap {

// Their names.
std::vector<std::string> RunSourceFiles();

// Throws OutputError.
void WriteRunSource(const std::string& folder, const RunSource& source);

// Fills what the files hold. Throws DataError.
void ReadRunSource(const std::string& folder, RunSource* source);

}  // namespace slcmap
