#include "odometry/finite_run.h"

#include <algorithm>
#include <cmath>
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

bool IsFinite(const CalibrationEstimate& e) {
  for (const Eigen::Vector3d& v :
       {e.imu_rotation_rad, e.lever_m, e.right_rotation_rad, e.imu_rotation_sigma_rad,
        e.lever_sigma_m, e.right_rotation_sigma_rad,
        Eigen::Vector3d(e.time_offset_s, e.focal_length, 0),
        Eigen::Vector3d(e.time_offset_sigma_s, e.focal_length_sigma, 0)}) {
    if (!Within(v, kMaxCorrection)) return false;
  }
  return true;
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

// With a world go the lines along its axes; the others are reported at its new place.
void DropNonFiniteWorlds(OdometryRun* run) {
  for (int i = static_cast<int>(run->manhattan_worlds.size()) - 1; i >= 0; --i) {
    if (IsFinite(run->manhattan_worlds[i])) continue;
    ++run->warnings["manhattan_worlds_not_finite"];
    run->manhattan_worlds.erase(run->manhattan_worlds.begin() + i);
    std::erase_if(run->lines, [&](const Line& line) { return line.world == i; });
    for (Line& line : run->lines) line.world -= line.world > i ? 1 : 0;
  }
}

}  // namespace

bool IsFinite(const OdometryRun& run) {
  return AllFinite(run.states) && AllFinite(run.keyframes) && AllFinite(run.landmarks) &&
         AllFinite(run.lines) && AllFinite(run.manhattan_worlds) && AllFinite(run.calibration);
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
  DropNonFiniteWorlds(&run);
  return run;
}

}  // namespace slcmap
