#include "mapping/adjustment/adjustment_state.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "data/core/error.h"
#include "odometry/factors/calibration_estimate.h"
#include "odometry/geometry/imu.h"
#include "odometry/geometry/lines.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/structure/building_deviation.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSharedShare = 0.5;  // of the variance of lines' deviations, with neighbours

constexpr double kMinDepth_m = 0.05;
constexpr int64_t kRateAveraged_ns = 20'000'000;  // before a cut, so that its noise tells nothing

// Where all blocks find room.
size_t CountNumbers(const OdometryRun& run) {
  return run.keyframes.size() * (kPoseSize + kSpeedBiasSize) + kCalibrationSize +
         run.manhattan_worlds.size() + 2 * run.sloped_directions.size() +
         run.landmarks.size() * kPointSize + kControlShiftSize +
         run.lines.size() * (kGeneralLineSize + kSharedDeviationSize);
}

// The state of the image nearest to a keyframe in its segment: its velocity and biases.
const OnlineState* StateAt(const OdometryRun& run, const Keyframe& keyframe) {
  const auto is_before = [](const OnlineState& state, int64_t ns) { return state.stamp_ns < ns; };
  auto at = std::lower_bound(run.states.begin(), run.states.end(), keyframe.stamp_ns, is_before);
  if (at == run.states.end() && at != run.states.begin()) --at;
  return at != run.states.end() && at->segment == keyframe.segment ? &*at : nullptr;
}

void AddFrames(const OdometryRun& run, AdjustmentState* state) {
  for (const Keyframe& keyframe : run.keyframes) {
    AdjustedFrame& frame = state->frames.emplace_back();
    frame.keyframe = &keyframe;
    std::array<double, kPoseSize> pose;
    PoseToBlock(keyframe.T_world_imu, pose.data());
    frame.pose = state->blocks.Add(pose);
    std::array<double, kSpeedBiasSize> speed_bias{};
    if (const OnlineState* online = StateAt(run, keyframe)) {
      Eigen::Map<Eigen::Matrix<double, kSpeedBiasSize, 1>>(speed_bias.data())
          << online->velocity_world_m_s,
          online->gyro_bias_rad_s, online->accel_bias_m_s2;
    }
    frame.speed_bias = state->blocks.Add(speed_bias);
  }
}

void AddCalibration(const OdometryRun& run, AdjustmentState* state) {
  ImuCalibrationBlock imu{};
  CameraCalibrationBlock cameras{};
  if (!run.calibration.empty()) {
    const CalibrationEstimate& known = run.calibration.back();
    std::copy_n(known.imu_rotation_rad.data(), 3, imu.begin() + kRowImuRotation);
    std::copy_n(known.lever_m.data(), 3, imu.begin() + kRowLever);
    imu[kRowTimeOffset] = known.time_offset_s;
    std::copy_n(known.imu_errors.data(), kImuErrorsSize, imu.begin() + kRowErrors);
    cameras = MakeCameraBlock(known);
  }
  state->imu_calibration = state->blocks.Add(imu);
  state->camera_calibration = state->blocks.Add(cameras);
}

void AddDirections(const OdometryRun& run, AdjustmentState* state) {
  for (const ManhattanWorld& world : run.manhattan_worlds) {
    state->headings.push_back(world.withdrawn ? nullptr : state->blocks.Add({{world.heading_rad}}));
  }
  for (const SlopedDirection& slope : run.sloped_directions) {
    const SlopeBlock block{slope.azimuth_rad, slope.elevation_rad};
    state->slopes.push_back(slope.withdrawn ? nullptr : state->blocks.Add(block));
  }
}

int64_t GetLandmark(const KeyframeObservation& seen) { return seen.landmark_id; }
int64_t GetLandmark(const LineObservation& seen) { return seen.id; }

// By landmark: the observations of one list of all keyframes, on the cameras' normalised planes.
template <typename Adjusted, typename Observation>
std::map<int64_t, std::vector<Adjusted>> CollectObservations(
    const OdometryRun& run, const std::vector<Observation> Keyframe::*list) {
  std::map<int64_t, std::vector<Adjusted>> observations;
  for (size_t k = 0; k < run.keyframes.size(); ++k) {
    for (const Observation& seen : run.keyframes[k].*list) {
      Adjusted observation{k, {}};
      const auto camera = run.rectified_rig.cameras.begin() + seen.camera;
      observation.measurement.left = PlaneFromPixel(camera[0], seen.left_px);
      observation.measurement.camera = seen.camera;
      if (seen.right_px) {
        observation.measurement.right = PlaneFromPixel(camera[1], *seen.right_px);
      }
      observations[GetLandmark(seen)].push_back(observation);
    }
  }
  return observations;
}

void AddPoints(const OdometryRun& run, AdjustmentState* state) {
  auto observations = CollectObservations<AdjustedPointObservation>(run, &Keyframe::observations);
  for (const Landmark& landmark : run.landmarks) {
    const auto seen = observations.find(landmark.id);
    if (seen == observations.end() ||
        static_cast<int>(seen->second.size()) < kAdjustmentMinPointKeyframes) {
      continue;
    }
    AdjustedPoint point;
    point.landmark = &landmark;
    point.host = seen->second.front().frame;
    point.camera = seen->second.front().measurement.camera;
    const RigidTransform T_world_camera =
        run.keyframes[point.host].T_world_imu * run.rectified_rig.T_imu_camera[point.camera];
    const Vector3d p_camera = T_world_camera.Inverse() * landmark.p_world;
    if (!(p_camera.z() > kMinDepth_m)) continue;
    const std::array<double, kPointSize> block{p_camera.x() / p_camera.z(),
                                               p_camera.y() / p_camera.z(), 1 / p_camera.z()};
    point.block = state->blocks.Add(block);
    point.observations = std::move(seen->second);
    state->points.push_back(std::move(point));
  }
}

template <typename Block>
double* BlockAt(const std::vector<Block>& blocks, int index) {
  return index >= 0 && index < std::ssize(blocks) ? blocks[static_cast<size_t>(index)] : nullptr;
}

// X and Y of a world change names where its heading is told modulo a right angle.
LineAxis AxisAlong(const Vector3d& direction, LineAxis axis, double heading_rad) {
  if (axis != LineAxis::kX && axis != LineAxis::kY) return axis;
  const bool is_along = std::abs(direction.dot(AxisDirection(axis, heading_rad))) > M_SQRT1_2;
  if (is_along) return axis;
  return axis == LineAxis::kX ? LineAxis::kY : LineAxis::kX;
}

double* FindShare(const AdjustedLine& line, double max_distance_m, AdjustmentState* state) {
  const Vector3d p_world = 0.5 * (line.line->start_world + line.line->end_world);
  for (const AdjustedShare& share : state->shares) {
    if (share.axis == line.axis && share.world == line.line->world &&
        (share.p_world - p_world).norm() < max_distance_m) {
      return share.block;
    }
  }
  const std::array<double, kSharedDeviationSize> none{};
  state->shares.push_back({line.axis, line.line->world, p_world, state->blocks.Add(none)});
  return state->shares.back().block;
}

// Binds a line to the direction that it follows; false where that was withdrawn.
bool BindDirection(const Line& line, const Vector3d& direction, const AdjustmentState& state,
                   AdjustedLine* out) {
  out->axis = line.axis;
  if (line.axis == LineAxis::kX || line.axis == LineAxis::kY) {
    out->heading = BlockAt(state.headings, line.world);
    if (!out->heading) return false;
    out->axis = AxisAlong(direction, line.axis, *out->heading);
  } else if (line.axis == LineAxis::kSloped) {
    out->slope = BlockAt(state.slopes, line.world);
    return out->slope != nullptr;
  }
  return true;
}

// A slope is never believed to be exact: it has few lines.
void SetDeviation(const OdometryRun& run, const AdjustmentOptions& options, AdjustmentState* state,
                  AdjustedLine* line) {
  const double building_rad = run.line_deviation_rad;
  if (line->slope) {
    line->deviation_sigma_rad = std::max(building_rad, BuildingDeviationOptions().start_sigma_rad);
  } else if (line->axis != LineAxis::kNone) {
    line->exact = building_rad < options.exact_below_rad;
    if (line->exact) return;
    const double believed_rad = options.deviation_scale * building_rad;
    line->deviation_sigma_rad = std::sqrt(1 - kSharedShare) * believed_rad;
    state->share_sigma_rad = std::sqrt(kSharedShare) * believed_rad;
    line->share = FindShare(*line, kSharedRadius_m, state);
  }
}

// The block of a line through what was seen of it; false where it passes its anchor.
bool PlaceLine(const Vector3d& middle, const Vector3d& direction, AdjustmentState* state,
               AdjustedLine* line) {
  const Vector3d from_anchor = middle - line->anchor_world;
  if (from_anchor.cross(direction).norm() < kMinDepth_m) return false;
  if (line->exact) {
    const double heading_rad = line->heading ? *line->heading : 0;
    line->block = state->blocks.Add(
        StructuralLineThrough({line->axis, line->anchor_world}, heading_rad, middle));
  } else {
    line->block = state->blocks.Add(GeneralLineThrough(line->anchor_world, middle, direction));
  }
  return true;
}

void AddLines(const OdometryRun& run, const AdjustmentOptions& options, AdjustmentState* state) {
  auto observations = CollectObservations<AdjustedLineObservation>(run, &Keyframe::lines);
  for (const Line& line : run.lines) {
    const auto seen = observations.find(line.id);
    const Vector3d along = line.end_world - line.start_world;
    if (seen == observations.end() || !(along.norm() > 1e-3)) continue;
    AdjustedLine out;
    out.line = &line;
    const Keyframe& first = run.keyframes[seen->second.front().frame];
    const int camera = seen->second.front().measurement.camera;
    out.anchor_world = first.T_world_imu * run.rectified_rig.T_imu_camera[camera].translation;
    if (!BindDirection(line, along.normalized(), *state, &out)) continue;
    SetDeviation(run, options, state, &out);
    if (!PlaceLine(0.5 * (line.start_world + line.end_world), along.normalized(), state, &out)) {
      continue;
    }
    out.observations = std::move(seen->second);
    state->lines.push_back(std::move(out));
  }
}

}  // namespace

double* BlockStore::Add(std::span<const double> values) {
  if (numbers_.size() + values.size() > numbers_.capacity()) {
    throw Error("an adjustment has more parameters than it has room for");
  }
  const size_t at = numbers_.size();
  numbers_.insert(numbers_.end(), values.begin(), values.end());
  return numbers_.data() + at;
}

PointAndDirection AdjustedLine::InWorld() const {
  if (!exact) return GeneralLineFromBlock(anchor_world, block);
  const double heading_rad = heading ? *heading : 0;
  return {CrossingPoint({axis, anchor_world}, heading_rad, block),
          AxisDirection(axis, heading_rad)};
}

CalibrationState AdjustmentState::calibration() const {
  CalibrationState out;
  std::copy_n(imu_calibration, kImuCalibrationSize, out.imu.begin());
  std::copy_n(camera_calibration, kCameraCalibrationSize, out.cameras.begin());
  return out;
}

AdjustmentState StateOfRun(const OdometryRun& run, const AdjustmentOptions& options) {
  AdjustmentState state(CountNumbers(run));
  state.rig = run.rectified_rig;
  AddFrames(run, &state);
  AddCalibration(run, &state);
  AddDirections(run, &state);
  AddPoints(run, &state);
  AddLines(run, options, &state);
  state.control_shift = state.blocks.Add(std::array<double, kControlShiftSize>{});
  return state;
}

Vector3d PointInWorld(const AdjustedPoint& point, const AdjustmentState& state) {
  const Vector3d p_camera = Vector3d(point.block[0], point.block[1], 1) / point.block[2];
  return PoseFromBlock(state.frames[point.host].pose) *
         (state.rig.T_imu_camera[point.camera] * p_camera);
}

void Preintegrate(const OdometryRun& run, AdjustmentState* state) {
  ImuBuffer imu;
  for (const ImuSample& sample : run.imu) imu.Add(sample);
  const int64_t given_ns = ToNanoseconds(state->rig.camera_time_offset_s);
  const int64_t found_ns = ToNanoseconds(state->imu_calibration[kRowTimeOffset]);
  for (size_t k = 0; k < state->frames.size(); ++k) {
    AdjustedFrame& frame = state->frames[k];
    const int64_t stamp_ns = frame.keyframe->stamp_ns + given_ns;
    frame.cut = {found_ns, imu.MeanRate(stamp_ns + found_ns, kRateAveraged_ns)};
    frame.from_previous.reset();
    if (k == 0 || state->frames[k - 1].keyframe->segment != frame.keyframe->segment) continue;
    const AdjustedFrame& previous = state->frames[k - 1];
    const int64_t from_ns = previous.keyframe->stamp_ns + given_ns + found_ns;
    const Eigen::Map<const Vector3d> gyro_bias(previous.speed_bias + 3);
    const Eigen::Map<const Vector3d> accel_bias(previous.speed_bias + 6);
    auto between = std::make_unique<Preintegration>(state->rig.imu_noise, gyro_bias, accel_bias,
                                                    GetErrors(state->imu_calibration));
    if (!imu.Covers(stamp_ns + found_ns)) continue;
    for (const ImuSample& sample : imu.Between(from_ns, stamp_ns + found_ns)) {
      between->Append(sample);
    }
    if (between->duration_s() > 0) frame.from_previous = std::move(between);
  }
}

}  // namespace slcmap::mapping
