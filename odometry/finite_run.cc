#include "odometry/finite_run.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "odometry/run_rows.h"

namespace slcmap {
namespace {

// Comparisons with a value that is not finite fail.
template <typename Values>
bool Within(const Values& values, double limit) {
  return values.allFinite() && values.cwiseAbs().maxCoeff() <= limit;
}

bool IsFinite(const RigidTransform& transform) {
  return Within(transform.translation, kMaxCoordinate_m) && transform.rotation.coeffs().allFinite();
}

bool IsFinite(const OnlineState& state) {
  return IsFinite(state.T_world_imu) && Within(state.velocity_world_m_s, kMaxSpeed_m_s) &&
         Within(state.gyro_bias_rad_s, kMaxBias) && Within(state.accel_bias_m_s2, kMaxBias);
}

bool IsFinite(const KeyframeObservation& seen) {
  return Within(seen.left_px, kMaxPixel) && (!seen.right_px || Within(*seen.right_px, kMaxPixel));
}

bool IsFinite(const LineSegment& segment) {
  return Within(segment.start, kMaxPixel) && Within(segment.end, kMaxPixel);
}

bool IsFinite(const LineObservation& seen) {
  return IsFinite(seen.left_px) && (!seen.right_px || IsFinite(*seen.right_px));
}

bool IsFinite(const Landmark& landmark) {
  return Within(landmark.p_world, kMaxCoordinate_m) && landmark.sigma_m >= 0 &&
         landmark.sigma_m <= kMaxSigma_m;
}

bool IsFinite(const Line& line) {
  return Within(line.start_world, kMaxCoordinate_m) && Within(line.end_world, kMaxCoordinate_m) &&
         Within(line.covariance_m2, kMaxSigma_m * kMaxSigma_m) && line.deviation_rad >= 0 &&
         line.deviation_sigma_rad >= 0 && line.deviation_sigma_rad <= kUnknownSigma_rad;
}

bool IsFinite(const ManhattanWorld& world) {
  return std::isfinite(world.heading_rad) && std::isfinite(world.sigma_rad);
}

bool IsFinite(const SlopedDirection& slope) {
  return std::isfinite(slope.azimuth_rad) && std::isfinite(slope.elevation_rad) &&
         std::isfinite(slope.azimuth_sigma_rad) && std::isfinite(slope.elevation_sigma_rad);
}

bool IsFinite(const CalibrationEstimate& e) {
  for (const Eigen::Vector3d& v :
       {e.imu_rotation_sigma_rad, e.lever_sigma_m, e.right_rotation_sigma_rad,
        Eigen::Vector3d(e.time_offset_sigma_s, e.focal_length_sigma, 0)}) {
    if (!Within(v, kMaxCorrectionSigma)) return false;
  }
  if (!Within(e.right_centre_px, kMaxCentre_px)) return false;
  if (!Within(e.right_centre_sigma_px, kMaxCentre_px)) return false;
  return Within(e.imu_rotation_rad, kMaxTurn_rad) && Within(e.lever_m, kMaxLever_m) &&
         Within(e.right_rotation_rad, kMaxTurn_rad) &&
         e.imu_errors.allFinite() && e.imu_errors.cwiseAbs().maxCoeff() <= kMaxImuError &&
         e.imu_errors_sigma.allFinite() &&
         e.imu_errors_sigma.cwiseAbs().maxCoeff() <= kMaxCorrectionSigma &&
         std::abs(e.time_offset_s) <= kMaxTimeCorrection_s &&
         std::abs(e.focal_length) <= kMaxFocalShare;
}

bool IsFinite(const Keyframe& keyframe);

template <typename Item>
bool AllFinite(const std::vector<Item>& items) {
  return std::all_of(items.begin(), items.end(), [](const Item& item) { return IsFinite(item); });
}

bool IsFinite(const Keyframe& keyframe) {
  return IsFinite(keyframe.T_world_imu) && AllFinite(keyframe.observations) &&
         AllFinite(keyframe.lines);
}

// Removes what is not finite; counts it in the warnings.
template <typename Item>
void DropNonFinite(const std::string& warning, std::vector<Item>* items, OdometryRun* run) {
  const auto dropped = std::erase_if(*items, [](const Item& item) { return !IsFinite(item); });
  if (dropped > 0) run->warnings[warning] += static_cast<int64_t>(dropped);
}

// What was known in segments of which nothing is left.
void DropCalibrationOfNoSegment(OdometryRun* run) {
  const std::set<int> segments = SegmentsOf(*run);
  std::erase_if(run->calibration,
                [&](const CalibrationEstimate& e) { return !segments.contains(e.segment); });
}

// With a direction go the lines along it (those of which is_one of them holds); the others are
// reported at its new place.
template <typename Direction, typename IsOne>
void DropNonFiniteDirections(const std::string& warning, const IsOne& is_one,
                             std::vector<Direction>* directions, OdometryRun* run) {
  for (int i = static_cast<int>(directions->size()) - 1; i >= 0; --i) {
    if (IsFinite((*directions)[i])) continue;
    ++run->warnings[warning];
    directions->erase(directions->begin() + i);
    std::erase_if(run->lines, [&](const Line& line) { return is_one(line) && line.world == i; });
    for (Line& line : run->lines) line.world -= is_one(line) && line.world > i ? 1 : 0;
  }
}

}  // namespace

bool IsFinite(const OdometryRun& run) {
  return AllFinite(run.states) && AllFinite(run.keyframes) && AllFinite(run.landmarks) &&
         AllFinite(run.lines) && AllFinite(run.manhattan_worlds) &&
         AllFinite(run.sloped_directions) && AllFinite(run.calibration);
}

OdometryRun WithoutNonFinite(OdometryRun run) {
  DropNonFinite("states_not_finite", &run.states, &run);
  for (Keyframe& keyframe : run.keyframes) {
    DropNonFinite("observations_not_finite", &keyframe.observations, &run);
    DropNonFinite("line_observations_not_finite", &keyframe.lines, &run);
  }
  DropNonFinite("keyframes_not_finite", &run.keyframes, &run);
  DropNonFinite("landmarks_not_finite", &run.landmarks, &run);
  DropNonFinite("lines_not_finite", &run.lines, &run);
  DropNonFinite("calibration_not_finite", &run.calibration, &run);
  DropCalibrationOfNoSegment(&run);
  const auto is_sloped = [](const Line& line) { return line.axis == LineAxis::kSloped; };
  DropNonFiniteDirections("manhattan_worlds_not_finite", std::not_fn(is_sloped),
                          &run.manhattan_worlds, &run);
  DropNonFiniteDirections("sloped_directions_not_finite", is_sloped, &run.sloped_directions, &run);
  return run;
}

}  // namespace slcmap
