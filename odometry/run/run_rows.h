// The rows that a run is written as, in its folder and in its journal: columns with their ranges,
// and both directions; and what a row holds, each field told once: the names of its columns, the
// member and the range. Tables, run.json and the search for damage all go by it.
#pragma once

#include <concepts>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <type_traits>

#include "data/core/types.h"
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

template <typename T, typename Item>
concept MaybeConst = std::same_as<std::remove_const_t<T>, Item>;

// VisitFields(visit, item) calls visit(names, value, least, most) for each field, in the order of
// its columns, of which there is one a number. Values are int, int64_t, bool, double or Eigen's.

template <typename Visit, MaybeConst<RigidTransform> Pose>
void VisitFields(Visit& visit, Pose& pose) {
  visit({"x_m", "y_m", "z_m"}, pose.translation, -kMaxCoordinate_m, kMaxCoordinate_m);
  visit({"qx", "qy", "qz", "qw"}, pose.rotation.coeffs(), -1.01, 1.01);
}

template <typename Visit, typename Stamp>
void VisitStamp(Visit& visit, const char* name, Stamp& stamp_ns) {
  visit({name}, stamp_ns, -static_cast<double>(kMaxStamp_ns), static_cast<double>(kMaxStamp_ns));
}

template <typename Visit, MaybeConst<OnlineState> State>
void VisitFields(Visit& visit, State& state) {
  VisitStamp(visit, "stamp_ns", state.stamp_ns);
  visit({"segment"}, state.segment, 0, kMaxSegment);
  VisitFields(visit, state.T_world_imu);
  visit({"vx_m_s", "vy_m_s", "vz_m_s"}, state.velocity_world_m_s, -kMaxSpeed_m_s, kMaxSpeed_m_s);
  visit({"gyro_bias_x_rad_s", "gyro_bias_y_rad_s", "gyro_bias_z_rad_s"}, state.gyro_bias_rad_s,
        -kMaxBias, kMaxBias);
  visit({"accel_bias_x_m_s2", "accel_bias_y_m_s2", "accel_bias_z_m_s2"}, state.accel_bias_m_s2,
        -kMaxBias, kMaxBias);
}

template <typename Visit, MaybeConst<Keyframe> Frame>
void VisitFields(Visit& visit, Frame& keyframe) {
  visit({"id"}, keyframe.id, 0, kMaxId);
  visit({"segment"}, keyframe.segment, 0, kMaxSegment);
  VisitStamp(visit, "stamp_ns", keyframe.stamp_ns);
  VisitFields(visit, keyframe.T_world_imu);
}

template <typename Visit, MaybeConst<Landmark> Point>
void VisitFields(Visit& visit, Point& landmark) {
  visit({"id"}, landmark.id, 0, kMaxId);
  visit({"segment"}, landmark.segment, 0, kMaxSegment);
  visit({"observations"}, landmark.observations, 0, kMaxId);
  visit({"x_m", "y_m", "z_m"}, landmark.p_world, -kMaxCoordinate_m, kMaxCoordinate_m);
  visit({"sigma_m"}, landmark.sigma_m, 0, kMaxSigma_m);
}

template <typename Visit, MaybeConst<ManhattanWorld> World>
void VisitFields(Visit& visit, World& world) {
  visit({"segment"}, world.segment, 0, kMaxSegment);
  visit({"heading_rad"}, world.heading_rad, -kMaxHeading_rad, kMaxHeading_rad);
  visit({"sigma_rad"}, world.sigma_rad, 0, kMaxHeading_rad);
  VisitStamp(visit, "found_at_ns", world.found_at_ns);
  visit({"withdrawn"}, world.withdrawn, 0, 1);
}

template <typename Visit, MaybeConst<SlopedDirection> Slope>
void VisitFields(Visit& visit, Slope& slope) {
  visit({"segment"}, slope.segment, 0, kMaxSegment);
  visit({"azimuth_rad"}, slope.azimuth_rad, -kMaxHeading_rad, kMaxHeading_rad);
  visit({"elevation_rad"}, slope.elevation_rad, 0, kMaxElevation_rad);
  visit({"azimuth_sigma_rad"}, slope.azimuth_sigma_rad, 0, kMaxHeading_rad);
  visit({"elevation_sigma_rad"}, slope.elevation_sigma_rad, 0, kMaxHeading_rad);
  VisitStamp(visit, "found_at_ns", slope.found_at_ns);
  visit({"withdrawn"}, slope.withdrawn, 0, 1);
}

template <typename Visit, MaybeConst<Line> RunLine>
void VisitFields(Visit& visit, RunLine& line) {
  auto& C = line.covariance_m2;
  Eigen::Matrix<double, 6, 1> upper;
  upper << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2);
  int axis = static_cast<int>(line.axis);
  visit({"id"}, line.id, 0, kMaxId);
  visit({"segment"}, line.segment, 0, kMaxSegment);
  visit({"axis"}, axis, 0, 4);
  visit({"world"}, line.world, -1, kMaxId);
  visit({"start_x_m", "start_y_m", "start_z_m"}, line.start_world, -kMaxCoordinate_m,
        kMaxCoordinate_m);
  visit({"end_x_m", "end_y_m", "end_z_m"}, line.end_world, -kMaxCoordinate_m, kMaxCoordinate_m);
  visit({"cov_xx_m2", "cov_xy_m2", "cov_xz_m2", "cov_yy_m2", "cov_yz_m2", "cov_zz_m2"}, upper,
        -kMaxVariance_m2, kMaxVariance_m2);
  visit({"observations"}, line.observations, 0, kMaxId);
  visit({"last_keyframe_id"}, line.last_keyframe, 0, kMaxId);
  visit({"deviation_rad"}, line.deviation_rad, 0, kMaxHeading_rad);
  visit({"deviation_sigma_rad"}, line.deviation_sigma_rad, 0, kUnknownSigma_rad);
  if constexpr (!std::is_const_v<RunLine>) {
    line.axis = static_cast<LineAxis>(axis);
    C << upper[0], upper[1], upper[2], upper[1], upper[3], upper[4], upper[2], upper[4], upper[5];
  }
}

template <typename Visit, MaybeConst<ImuSample> Sample>
void VisitFields(Visit& visit, Sample& sample) {
  VisitStamp(visit, "stamp_ns", sample.stamp_ns);
  visit({"wx_rad_s", "wy_rad_s", "wz_rad_s"}, sample.angular_velocity_rad_s, -kMaxGyro_rad_s,
        kMaxGyro_rad_s);
  visit({"ax_m_s2", "ay_m_s2", "az_m_s2"}, sample.specific_force_m_s2, -kMaxAccel_m_s2,
        kMaxAccel_m_s2);
}

template <typename Visit, MaybeConst<CalibrationEstimate> Estimate>
void VisitFields(Visit& visit, Estimate& e) {
  VisitStamp(visit, "stamp_ns", e.stamp_ns);
  visit({"segment"}, e.segment, 0, kMaxSegment);
  visit({"time_offset_s"}, e.time_offset_s, -kMaxTimeCorrection_s, kMaxTimeCorrection_s);
  visit({"imu_rotation_x_rad", "imu_rotation_y_rad", "imu_rotation_z_rad"}, e.imu_rotation_rad,
        -kMaxTurn_rad, kMaxTurn_rad);
  visit({"lever_x_m", "lever_y_m", "lever_z_m"}, e.lever_m, -kMaxLever_m, kMaxLever_m);
  visit({"right_rotation_x_rad", "right_rotation_y_rad", "right_rotation_z_rad"},
        e.right_rotation_rad, -kMaxTurn_rad, kMaxTurn_rad);
  visit({"focal_length"}, e.focal_length, -kMaxFocalShare, kMaxFocalShare);
  visit({"right_centre_x_px", "right_centre_y_px"}, e.right_centre_px, -kMaxCentre_px,
        kMaxCentre_px);
  visit({"accel_scale_x", "accel_scale_y", "accel_scale_z", "accel_axes_yx", "accel_axes_zx",
         "accel_axes_zy", "gyro_scale_x", "gyro_scale_y", "gyro_scale_z", "gyro_axes_xy",
         "gyro_axes_xz", "gyro_axes_yx", "gyro_axes_yz", "gyro_axes_zx", "gyro_axes_zy"},
        e.imu_errors, -kMaxImuError, kMaxImuError);
  visit({"time_offset_sigma_s"}, e.time_offset_sigma_s, 0, kMaxCorrectionSigma);
  visit({"imu_rotation_x_sigma_rad", "imu_rotation_y_sigma_rad", "imu_rotation_z_sigma_rad"},
        e.imu_rotation_sigma_rad, 0, kMaxCorrectionSigma);
  visit({"lever_x_sigma_m", "lever_y_sigma_m", "lever_z_sigma_m"}, e.lever_sigma_m, 0,
        kMaxCorrectionSigma);
  visit({"right_rotation_x_sigma_rad", "right_rotation_y_sigma_rad", "right_rotation_z_sigma_rad"},
        e.right_rotation_sigma_rad, 0, kMaxCorrectionSigma);
  visit({"focal_length_sigma"}, e.focal_length_sigma, 0, kMaxCorrectionSigma);
  visit({"right_centre_x_sigma_px", "right_centre_y_sigma_px"}, e.right_centre_sigma_px, 0,
        kMaxCentre_px);
  visit({"accel_scale_x_sigma", "accel_scale_y_sigma", "accel_scale_z_sigma", "accel_axes_yx_sigma",
         "accel_axes_zx_sigma", "accel_axes_zy_sigma", "gyro_scale_x_sigma", "gyro_scale_y_sigma",
         "gyro_scale_z_sigma", "gyro_axes_xy_sigma", "gyro_axes_xz_sigma", "gyro_axes_yx_sigma",
         "gyro_axes_yz_sigma", "gyro_axes_zx_sigma", "gyro_axes_zy_sigma"},
        e.imu_errors_sigma, 0, kMaxCorrectionSigma);
}

}  // namespace slcmap::odometry
