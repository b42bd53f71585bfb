#include "odometry/run/run_queries.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "odometry/geometry/imu.h"
#include "odometry/run/run.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline odometry {
namespace {

constexpr std::size_t kRecentKeyframes = 10;
constexpr int kLongLife = 10;  // keyframes

int64_t FirstRecentKeyframe(const std::vector<Keyframe>& keyframes) {
  if (keyframes.size() <= kRecentKeyframes) return std::numeric_limits<int64_t>::min();
  return keyframes[keyframes.size() - kRecentKeyframes].id;
}

void RenameMerged(const std::map<int64_t, int64_t>& survivors,
                  std::vector<LineObservation>* observations) {
  for (LineObservation& observation : *observations) {
    const auto survivor = survivors.find(observation.id);
    if (survivor != survivors.end()) observation.id = survivor->second;
  }
  const auto id = [](const LineObservation& observation) { return observation.id; };
  std::ranges::stable_sort(*observations, {}, id);
  const auto rest = std::ranges::unique(*observations, {}, id);
  observations->erase(rest.begin(), rest.end());
}

template <typename Direction>
bool IsWithdrawn(const std::vector<Direction>& directions, int index) {
  const auto i = static_cast<std::size_t>(index);
  return index >= 0 && i < directions.size() && directions[i].withdrawn;
}

bool FollowsWithdrawn(const Line& line, const OdometryRun& run) {
  if (line.axis == LineAxis::kSloped) return IsWithdrawn(run.sloped_directions, line.world);
  return IsWithdrawn(run.manhattan_worlds, line.world);
}

}  // namespace

void ResolveMergedLines(OdometryRun* run) {
  // A line is merged into one of a lower id, so what a chain leads to is already resolved.
  for (auto& [id, survivor] : run->line_merges) {
    const auto next = run->line_merges.find(survivor);
    if (next != run->line_merges.end()) survivor = next->second;
  }
  for (Keyframe& keyframe : run->keyframes) RenameMerged(run->line_merges, &keyframe.lines);
}

double LargestSigma(const Line& line) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(line.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues().z(), 0.0));
}

std::vector<MapLine> MapLines(const OdometryRun& run) {
  const int64_t first_recent = FirstRecentKeyframe(run.keyframes);
  std::vector<MapLine> lines;
  for (const Line& line : run.lines) {
    if (FollowsWithdrawn(line, run)) continue;
    lines.push_back({line.id, line.segment, line.axis, line.world, LargestSigma(line),
                     line.last_keyframe >= first_recent, line.start_world, line.end_world,
                     line.observations, line.deviation_rad, line.deviation_sigma_rad});
  }
  return lines;
}

LineTrackLengths MeasureLineTracks(const std::vector<Line>& lines) {
  std::vector<int> lives;
  for (const Line& line : lines) lives.push_back(line.observations);
  return ComputeTrackLengths(std::move(lives));
}

LineTrackLengths ComputeTrackLengths(std::vector<int> lives) {
  if (lives.empty()) return {};
  std::sort(lives.begin(), lives.end());
  const auto count = static_cast<double>(lives.size());
  LineTrackLengths result;
  result.lines = static_cast<int64_t>(lives.size());
  result.median_keyframes = 0.5 * (lives[(lives.size() - 1) / 2] + lives[lives.size() / 2]);
  result.mean_keyframes = std::accumulate(lives.begin(), lives.end(), 0.0) / count;
  const auto first_long = std::upper_bound(lives.begin(), lives.end(), kLongLife);
  result.share_over_10 = static_cast<double>(lives.end() - first_long) / count;
  return result;
}

PointTrackLengths MeasurePointTracks(const std::vector<Keyframe>& keyframes) {
  std::unordered_map<int64_t, int> seen;
  for (const Keyframe& keyframe : keyframes) {
    for (const KeyframeObservation& observation : keyframe.observations) {
      ++seen[observation.landmark_id];
    }
  }
  const auto once =
      std::count_if(seen.begin(), seen.end(), [](const auto& point) { return point.second == 1; });
  return {static_cast<int64_t>(seen.size()), once};
}

namespace {

// Comparisons with a value that is not finite fail.
template <typename Values>
bool Within(const Values& values, double limit) {
  return values.allFinite() && values.cwiseAbs().maxCoeff() <= limit;
}

// Whether numbers are in the range of their columns.
struct RangeCheck {
  bool holds = true;

  template <typename T>
  void operator()(std::initializer_list<const char*>, const T& value, double least, double most) {
    if constexpr (std::is_same_v<T, double>) {
      holds = holds && value >= least && value <= most;
    } else if constexpr (!std::is_integral_v<T>) {
      for (const double number : value) holds = holds && number >= least && number <= most;
    }
  }
};

template <typename Item>
bool IsFinite(const Item& item) {
  RangeCheck check;
  VisitFields(check, item);
  return check.holds;
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

bool IsFinite(const Keyframe& keyframe);

template <typename Item>
bool AllFinite(const std::vector<Item>& items) {
  return std::all_of(items.begin(), items.end(), [](const Item& item) { return IsFinite(item); });
}

bool IsFinite(const Keyframe& keyframe) {
  return IsFinite<Keyframe>(keyframe) && AllFinite(keyframe.observations) &&
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
  const std::set<int> segments = CollectSegments(*run);
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

Rig CalibratedRig(const Rig& given, const Rig& rectified, const CalibrationEstimate& estimate) {
  Rig rig = given;
  const ImuCorrection found = MakeCorrection(estimate.imu_errors);
  rig.imu_correction = {found.accel * given.imu_correction.accel,
                        found.gyro * given.imu_correction.gyro};
  rig.camera_time_offset_s += estimate.time_offset_s;
  for (size_t i = 0; i < std::min(rig.readout_s.size(), rectified.readout_s.size()); ++i) {
    if (rectified.readout_s[i] != 0) rig.readout_s[i] = rectified.readout_s[i];  // as found
  }
  if (IsStereo(given)) {
    // The raw right camera turns with the rectified one.
    const Eigen::Quaterniond& R_imu_rectified = rectified.T_imu_camera[1].rotation;
    rig.cameras[1].cx_px += estimate.right_centre_px.x();
    rig.cameras[1].cy_px += estimate.right_centre_px.y();
    rig.T_imu_camera[1].rotation = R_imu_rectified * ExpRotation(estimate.right_rotation_rad) *
                                   R_imu_rectified.conjugate() * given.T_imu_camera[1].rotation;
  }
  const RigidTransform T_given_imu(ExpRotation(estimate.imu_rotation_rad), estimate.lever_m);
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    rig.T_imu_camera[i] = T_given_imu.Inverse() * rig.T_imu_camera[i];
    rig.cameras[i].fx_px *= 1 + estimate.focal_length;
    rig.cameras[i].fy_px *= 1 + estimate.focal_length;
  }
  return rig;
}

namespace {

constexpr std::pair<Method, const char*> kMethodNames[] = {{Method::kPointsMono, "points-mono"},
                                                           {Method::kPoints, "points"},
                                                           {Method::kPointsLines, "points-lines"},
                                                           {Method::kStructural, "structural"},
                                                           {Method::kSlc, "slc"}};

}  // namespace

Method MethodFromName(const std::string& name) {
  for (const auto& [method, method_name] : kMethodNames) {
    if (name == method_name) return method;
  }
  throw ConfigError("method: found '" + name +
                    "', expected points-mono, points, points-lines, structural or slc");
}

void CheckMethodName(const std::string& place, const std::string& name) {
  if (name == kExternalPoses) return;
  try {
    MethodFromName(name);
  } catch (const ConfigError& error) {
    throw DataError(place + ": " + error.what());
  }
}

std::string MethodName(Method method) {
  for (const auto& [named, name] : kMethodNames) {
    if (named == method) return name;
  }
  throw ConfigError("method: found one without a name");
}

bool UsesTwoCameras(Method method, const Rig& rig) {
  return method != Method::kPointsMono && HasTwoCameras(rig);
}

bool UsesRight(Method method, const Rig& rig) {
  return UsesTwoCameras(method, rig) && IsStereo(rig);
}

bool UsesLines(Method method) { return method != Method::kPointsMono && method != Method::kPoints; }

bool UsesStructure(Method method) {
  return method == Method::kStructural || method == Method::kSlc;
}

}  // namespace slcmap::odometry
