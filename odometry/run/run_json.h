// The JSON files of a run folder: run.json, rig.json and timings.json. Include in .cc files only.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "data/io/json.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// How many of each kind a run holds, by the names of run.json.
std::vector<std::pair<const char*, std::size_t>> RunCounts(const OdometryRun& run);

// Method, completeness, warnings, Manhattan worlds, where the run came from, a summary of the
// lines' lives and of each segment, counts, and the files beside it, which must be there. Throws
// OutputError.
void WriteRunSummary(const std::string& path, const OdometryRun& run,
                     const std::vector<std::string>& files);

// Fills id, method, complete, partial_reason, verdict, what ParseSoFar() does, Manhattan worlds,
// slopes and source; returns the whole. Throws DataError.
Json ReadRunSummary(const std::string& path, OdometryRun* run);

// Counts by kind; throws DataError naming `path` where one is negative.
std::map<std::string, int64_t> ParseWarnings(const std::string& path, const Json& json);

// Throws DataError naming `path` where a figure is missing or negative.
Json FiguresJson(const RunFigures& figures);
RunFigures ParseFigures(const std::string& path, const Json& json);

// Fills what a run knows of itself at any time: figures, warnings and line_deviation_rad. Throws
// DataError naming `path`.
void ParseSoFar(const std::string& path, const Json& json, OdometryRun* run);

// The part of a summary that is known before a run begins: method and source. `place` stands in the
// messages of DataErrors.
Json HeaderJson(const OdometryRun& run);
void ParseHeader(const std::string& place, const Json& json, OdometryRun* run);

// Cameras, extrinsics and IMU noise; every key says its unit. Throw OutputError and DataError.
void WriteRig(const std::string& path, const Rig& rig);
Rig ReadRig(const std::string& path);

// Throw OutputError and DataError.
void WriteTimings(const std::string& path, const RunTimings& timings);
RunTimings ReadTimings(const std::string& path);

}  // namespace slcmap::odometry
