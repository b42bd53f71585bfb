// The JSON files of a run folder: run.json, rig.json and timings.json.
#pragma once

#include <string>

#include "odometry/run.h"

namespace slcmap {

// Method, completeness, warnings, and a summary of each segment. Throws OutputError.
void WriteRunSummary(const std::string& path, const OdometryRun& run);

// Fills method, complete, partial_reason and warnings. Throws DataError.
void ReadRunSummary(const std::string& path, OdometryRun* run);

// Cameras, extrinsics and IMU noise; every key says its unit. Throw OutputError and DataError.
void WriteRig(const std::string& path, const Rig& rig);
Rig ReadRig(const std::string& path);

// Throw OutputError and DataError.
void WriteTimings(const std::string& path, const RunTimings& timings);
RunTimings ReadTimings(const std::string& path);

}  // namespace slcmap
