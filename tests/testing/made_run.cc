#include "tests/testing/made_run.h"

#include <algorithm>

namespace slcmap::testing {
namespace {

constexpr int kSeconds = 5;
constexpr int kRate_hz = 10;

Rig MakeRig() {
  Rig rig;
  for (Camera& camera : rig.cameras) {
    camera = {Distortion::kNone, 640, 480, 320, 320, 319.5, 239.5, Eigen::Vector4d::Zero()};
  }
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

}  // namespace

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
        {i / kRate_hz, 0, state.stamp_ns, TruePose(time_s), ObserveAll(run, TruePose(time_s))});
  }
  return run;
}

}  // namespace slcmap::testing
