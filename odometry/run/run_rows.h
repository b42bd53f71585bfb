// The rows that a run is written as, in its folder and in its journal: columns with their ranges,
// and both directions.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "data/io/csv.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// What lies farther off, or is larger, is taken for damage: it is not written, and refused when
// read.
inline constexpr double kMaxCoordinate_m = 1e6;
inline constexpr double kMaxPixel = 1e6;
inline constexpr double kMaxSigma_m = kUnknownSigma_m;
inline constexpr double kMaxVariance_m2 = kMaxSigma_m * kMaxSigma_m;
inline constexpr double kMaxId = 2147483647;  // points.ply and lines.ply hold them as int
inline constexpr double kMaxSegment = 1e6;
inline constexpr double kMaxSpeed_m_s = 1e5;
inline constexpr double kMaxBias = 1e4;
// Corrections of a calibration, far beyond what CalibrationOptions lets estimates be.
inline constexpr double kMaxTimeCorrection_s = 10;
inline constexpr double kMaxTurn_rad = 3.2;
inline constexpr double kMaxLever_m = 100;
inline constexpr double kMaxFocalShare = 0.9;
inline constexpr double kMaxCentre_px = 1000;
inline constexpr double kMaxImuError = 0.9;
inline constexpr double kMaxCorrectionSigma = 1e3;  // in any unit
inline constexpr int64_t kMaxStamp_ns = 4'000'000'000'000'000'000;
inline constexpr double kMaxHeading_rad = 7;
inline constexpr double kMaxElevation_rad = 1.5708;

constexpr CsvColumn IntegerColumn(const char* name, double least, double most) {
  return {name, CsvColumn::Kind::kInteger, least, most};
}

// The tables of a run; the values are their names in a journal.
inline constexpr const char* kStateTable = "state";
inline constexpr const char* kKeyframeTable = "keyframe";
inline constexpr const char* kObservationTable = "observation";
inline constexpr const char* kLandmarkTable = "landmark";
inline constexpr const char* kWorldTable = "world";
inline constexpr const char* kSlopeTable = "slope";
inline constexpr const char* kLineTable = "line";
inline constexpr const char* kLineObservationTable = "line_observation";
inline constexpr const char* kLinePointTable = "line_point";
inline constexpr const char* kLineMergeTable = "line_merge";
inline constexpr const char* kImuTable = "imu";
inline constexpr const char* kCalibrationTable = "calibration";

// By name. Rows of observations name the camera in runs of more than two.
inline bool NamesCameras(const OdometryRun& run) { return run.rectified_rig.cameras.size() > 2; }
const std::map<std::string, CsvColumns>& RunColumns(bool names_cameras = false);

// Rows with their end of line.
std::string Row(const OnlineState& state);
std::string Row(const Keyframe& keyframe);  // without its observations
std::string Row(int64_t keyframe_id, const KeyframeObservation& observation, bool names_camera);
std::string Row(int64_t keyframe_id, const LineObservation& observation, bool names_camera);
std::string Row(const Landmark& landmark);
std::string Row(int64_t index, const ManhattanWorld& world);
std::string Row(int64_t index, const SlopedDirection& slope);
std::string Row(const Line& line);             // without its points
std::string Row(int64_t line_id, int64_t id);  // of a landmark on it, or the line it is merged into
std::string Row(const ImuSample& sample);
std::string Row(const CalibrationEstimate& estimate);

// Those that a state or a keyframe is of.
std::set<int> CollectSegments(const OdometryRun& run);

// Add a table to a run. Throw DataError, naming file and row, for ids that were there before,
// stamps that do not rise, and references to what there is not: what is referred to must be read
// before.
void ReadStates(const CsvTable& table, OdometryRun* run);
void ReadKeyframes(const CsvTable& table, OdometryRun* run);
void ReadObservations(const CsvTable& table, OdometryRun* run);
void ReadLandmarks(const CsvTable& table, OdometryRun* run);
// Of worlds, a later row of an index replaces an earlier one.
void ReadWorlds(const CsvTable& table, OdometryRun* run);
void ReadSlopes(const CsvTable& table, OdometryRun* run);
void ReadLines(const CsvTable& table, OdometryRun* run);
void ReadLineObservations(const CsvTable& table, OdometryRun* run);
void ReadLinePoints(const CsvTable& table, OdometryRun* run);
void ReadLineMerges(const CsvTable& table, OdometryRun* run);
void ReadImu(const CsvTable& table, OdometryRun* run);
void ReadCalibration(const CsvTable& table, OdometryRun* run);

}  // namespace slcmap::odometry
