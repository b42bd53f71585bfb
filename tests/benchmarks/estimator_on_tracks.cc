// What the estimator makes of simulated tracks: error and consistency against the noise.
//
//   estimator_on_tracks [--mono] [--moving] [--seconds S] [--runs N] [--sigma PX] [--keyframes N]
//   ...
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

double ApeAfterGauge(const SimulatedRun& run) {
  const RigidTransform gauge = GaugeFromFirst(run);
  double sum = 0;
  for (size_t i = 0; i < run.states.size(); ++i) {
    sum += (gauge * run.states[i].T_world_imu.translation - run.truth[i].translation).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(run.states.size()));
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  using namespace slcmap;
  CLI::App app("Estimator on simulated tracks");
  SimulatedRunOptions options;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.5;
  options.duration_s = 40;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  int runs = 5;
  bool mono = false, moving = false;
  std::string config;
  app.add_option("--config", config);
  app.add_option("--seconds", options.duration_s);
  app.add_option("--runs", runs);
  app.add_option("--sigma", options.pixel_sigma_px);
  app.add_flag("--mono", mono);
  app.add_flag("--moving", moving);
  CLI11_PARSE(app, argc, argv);
  if (!config.empty()) options.odometry = OdometryOptions::FromYaml(config);
  options.odometry.window.point_sigma_px = options.pixel_sigma_px;
  if (mono) options.odometry.method = Method::kPointsMono;
  if (moving) options.stand_still_s = 0;
  double ape = 0, nees = 0, nees_yaw_pos = 0;
  for (int i = 0; i < runs; ++i) {
    options.seed = 10 + i;
    const auto start = std::chrono::steady_clock::now();
    const SimulatedRun run = RunOnSimulatedTracks(options);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    std::printf(
        "run %d: %zu states, %zu keyframes, APE %.4f m, largest %.4f m, removed %zu, segments %d, "
        "%.2f ms/frame, NEES pose %.1f / 6, all %.1f / 15\n",
        i, run.states.size(), run.run.keyframes.size(), ApeAfterGauge(run),
        LargestPositionError(run), run.removed_points, run.states.back().segment,
        1e3 * spent.count() / (options.duration_s * 20), run.final_pose_nees, run.final_nees);
    ape += ApeAfterGauge(run) / runs;
    nees += run.final_nees / runs;
    nees_yaw_pos += run.final_pose_nees / runs;
  }
  std::printf("mean APE %.4f m, NEES pose %.2f / 6, all %.2f / 15\n", ape, nees_yaw_pos, nees);
}
