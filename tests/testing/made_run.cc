#include "tests/testing/made_run.h"

#include <algorithm>
#include <string>

#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {
namespace {

constexpr int kSeconds = 5;
constexpr int kRate_hz = 10;

Rig MakeRig() {
  Rig rig;
  rig.cameras.assign(2, PinholeCamera(640, 480, 320, 319.5, 239.5));
  // The camera's z is the body's x, its x is -y, its y is -z.
  Eigen::Matrix3d R_imu_camera;
  R_imu_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  rig.T_imu_camera[0] = {Eigen::Quaterniond(R_imu_camera), {0, 0, 0}};
  rig.T_imu_camera[1] = {Eigen::Quaterniond(R_imu_camera), {0, -0.1, 0}};
  return rig;
}

RigidTransform TruePose(double time_s) { return {Eigen::Quaterniond::Identity(), {time_s, 0, 1}}; }

int64_t StampAt(double time_s) { return 1600000000000000000 + ToNanoseconds(time_s); }

std::vector<KeyframeObservation> ObserveAll(const OdometryRun& run,
                                            const RigidTransform& T_world_imu) {
  const Rig& rig = run.rectified_rig;
  std::vector<KeyframeObservation> observations;
  for (const Landmark& landmark : run.landmarks) {
    const auto pixel_px = [&](int camera) {
      return *rig.cameras[camera].Project((T_world_imu * rig.T_imu_camera[camera]).Inverse() *
                                          landmark.p_world);
    };
    observations.push_back({landmark.id, pixel_px(0), pixel_px(1)});
  }
  return observations;
}

// A line on the wall x = 10.02 m with standard deviations of 2 mm along x and of 4 mm along the
// wall, at right angles to the line.
Line MakeLine(int64_t id, LineAxis axis, const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  Line line;
  line.id = id;
  line.axis = axis;
  line.world = axis == LineAxis::kVertical ? -1 : 0;
  line.start_world = start;
  line.end_world = end;
  const Eigen::Vector3d across =
      (end - start).normalized().cross(Eigen::Vector3d::UnitX()).normalized();
  line.covariance_m2 = 4e-6 * Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitX() +
                       16e-6 * across * across.transpose();
  return line;
}

std::vector<Line> MakeLines() {
  std::vector<Line> lines;
  for (int i = 0; i < 20; ++i) {
    const double y = 0.2 * i - 1.88;
    lines.push_back(MakeLine(100 + i, LineAxis::kVertical, {10.02, y, 0.02}, {10.02, y, 1.92}));
    for (int j = 0; j < 20; ++j) lines.back().point_ids.push_back(20 * j + i);
  }
  for (int i = 0; i < 4; ++i) {
    lines.push_back(MakeLine(120 + i, LineAxis::kY, {10.02, -1.9, 0.5 * i}, {10.02, 1.9, 0.5 * i}));
  }
  return lines;
}

// Adds the observation of a line to the keyframe.
void Observe(const Rig& rig, Line* line, Keyframe* keyframe) {
  const auto segment_px = [&](int camera) {
    const RigidTransform T_camera_world =
        (keyframe->T_world_imu * rig.T_imu_camera[camera]).Inverse();
    return LineSegment{*rig.cameras[camera].Project(T_camera_world * line->start_world),
                       *rig.cameras[camera].Project(T_camera_world * line->end_world)};
  };
  keyframe->lines.push_back({line->id, segment_px(0), segment_px(1)});
  ++line->observations;
  line->last_keyframe = keyframe->id;
}

}  // namespace

RunSource MakeSource(const OdometryRun& run) {
  RunSource source{"0.1.0", "/recordings/hall", "its own", "method: points\n", {}, {}, {}, {}};
  source.corrections = {{kRightTurnCorrection, {0.25, 0, -0.125}, "right camera turned"}};
  source.raw_rig = run.rectified_rig;
  source.check_errors = {"an error that was forced"};
  source.opened.cameras = {0, 2};
  source.opened.calibration = "/recordings/chain.yaml";
  source.opened.masks = {"/recordings/left.png", "none"};
  source.opened.max_stereo_offset_s = 0.008;
  source.opened.right_offset_s = -0.012;
  for (const Keyframe& keyframe : run.keyframes) {
    const std::string name = std::to_string(keyframe.stamp_ns) + ".png";
    source.images.push_back({keyframe.stamp_ns, "cam0/data/" + name, "cam1/data/" + name});
  }
  return source;
}

OdometryRun MakeLineRun() {
  OdometryRun run = MakeWallRun();
  run.manhattan_worlds = {{0, 0, 0.001, run.keyframes[0].stamp_ns}};
  run.lines = MakeLines();
  for (Keyframe& keyframe : run.keyframes) {
    for (Line& line : run.lines) {
      const bool sees_all = keyframe.id <= 3;
      const bool sees_vertical = sees_all || keyframe.id == 5;
      if (line.axis == LineAxis::kVertical ? sees_vertical : sees_all) {
        Observe(run.rectified_rig, &line, &keyframe);
      }
    }
  }
  return run;
}

OdometryRun MakeWallRun() {
  OdometryRun run;
  run.method = "points";
  run.complete = true;
  run.rectified_rig = MakeRig();
  for (int i = 0; i < 400; ++i) {
    run.landmarks.push_back({i, 0, {10.02, 0.2 * (i % 20) - 1.88, 0.1 * (i / 20) + 0.02}, 0.02, 6});
  }
  for (int i = 0; i <= kSeconds * kRate_hz; ++i) {
    const double time_s = static_cast<double>(i) / kRate_hz;
    OnlineState state;
    state.stamp_ns = StampAt(time_s);
    state.T_world_imu = TruePose(time_s);
    state.T_world_imu.translation.y() = 0.02 * std::max(time_s - 1, 0.0);
    run.states.push_back(state);
    if (i % kRate_hz != 0) continue;
    run.keyframes.push_back(
        {i / kRate_hz, 0, state.stamp_ns, TruePose(time_s), ObserveAll(run, TruePose(time_s)), {}});
  }
  return run;
}

}  // namespace slcmap::testing
