// The JSON files of a run folder: run.json, rig.json and timings.json.
#pragma once

#include <string>

#include "odometry/run.h"

namespace slcmap {

// Method, completeness, warnings, Manhattan worlds, and a summary of the lines' lives and of each
// segment. Throws OutputError.
void WriteRunSummary(const std::string& path, const OdometryRun& run);

// What the folder of a run holds, by the version of its format.
enum class RunContents {
  kPoints,         // version 1
  kPointsAndLines  // version 2
};

// Fills method, complete, partial_reason, warnings and, where there are lines, Manhattan worlds.
// Throws DataError.
RunContents ReadRunSummary(const std::string& path, OdometryRun* run);

// Cameras, extrinsics and IMU noise; every key says its unit. Throw OutputError and DataError.
void WriteRig(const std::string& path, const Rig& rig);
Rig ReadRig(const std::string& path);

// Throw OutputError and DataError.
void WriteTimings(const std::string& path, const RunTimings& timings);
RunTimings ReadTimings(const std::string& path);

}  // namespace slcmap
