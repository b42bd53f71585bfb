// What the adjustment over all keyframes makes of a run, against the truth.
//
//   adjust_run RUN --truth TRAJECTORY [--config YAML] [--sequence SEQ] [--write TUM]
//
// Without --sequence places are recognised by edges alone.
// A row: RMSE of position (m) of the online poses, of those that the window's keyframes correct,
// and of the adjusted ones, all images; the last over the first; what was found of the calibration;
// seconds of the CPU, and of the recording.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>

#include "apps/evaluation/trajectory_metrics.h"
#include "mapping/adjustment/adjustment.h"
#include "mapping/map/refinement.h"
#include "mapping/options.h"
#include "mapping/views/recorded_views.h"
#include "odometry/run/run_folder.h"

namespace slcmap {
namespace {

double Ape(const Trajectory& truth, const Trajectory& estimate) {
  return EvaluateTrajectory(truth, estimate, {}, {}).absolute.front().position_m.rmse;
}

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void PrintCalibration(const char* name, const CalibrationEstimate& c) {
  constexpr double kDeg = 180 / M_PI;
  std::printf(
      "  %-8s time %+.3f (%.3f) ms, IMU %+.4f %+.4f %+.4f (%.4f) deg, right %+.4f %+.4f %+.4f "
      "(%.4f %.4f %.4f) deg, focal %+.4f (%.4f) %%\n",
      name, 1e3 * c.time_offset_s, 1e3 * c.time_offset_sigma_s, kDeg * c.imu_rotation_rad.x(),
      kDeg * c.imu_rotation_rad.y(), kDeg * c.imu_rotation_rad.z(),
      kDeg * c.imu_rotation_sigma_rad.maxCoeff(), kDeg * c.right_rotation_rad.x(),
      kDeg * c.right_rotation_rad.y(), kDeg * c.right_rotation_rad.z(),
      kDeg * c.right_rotation_sigma_rad.x(), kDeg * c.right_rotation_sigma_rad.y(),
      kDeg * c.right_rotation_sigma_rad.z(), 100 * c.focal_length, 100 * c.focal_length_sigma);
}

void PrintFigures(const AdjustmentFigures& f) {
  std::printf(
      "  %ld keyframes, %ld points in %ld (%ld rejected), %ld lines in %ld (%ld rejected), "
      "%d iterations, cost %.0f to %.0f; %ld closures, %ld taken back, %ld points and %ld edges "
      "matched\n",
      f.keyframes, f.points, f.point_observations, f.rejected_point_observations, f.lines,
      f.line_observations, f.rejected_line_observations, f.iterations, f.initial_cost, f.final_cost,
      f.closures, f.closures_rejected, f.matched_points, f.matched_edges);
}

void Measure(const std::string& folder, const std::string& truth_path,
             const AdjustmentOptions& options, const std::string& sequence,
             const std::string& written) {
  OdometryRun run = ReadRunFolder(folder);
  Trajectory online;
  for (const OnlineState& state : run.states) online.push_back({state.stamp_ns, state.T_world_imu});
  std::map<std::string, int64_t> warnings;
  const Trajectory window = RefineTrajectory(run, &warnings);
  RecordedViews views;
  if (!sequence.empty()) views = ViewsOfRun(run, sequence);
  const double start_s = CpuSeconds();
  const AdjustmentResult result = Adjust(run, options, views.images.get());
  const double spent_s = CpuSeconds() - start_s;
  if (!result.usable) std::printf("not usable: %s\n", result.reason.c_str());
  if (!run.calibration.empty()) PrintCalibration("online", run.calibration.back());
  if (result.calibration) PrintCalibration("adjusted", *result.calibration);
  PrintFigures(result.figures);
  Apply(result, &run);
  const Trajectory adjusted = RefineTrajectory(run, &warnings);
  if (!written.empty()) WriteTumTrajectory(written, adjusted);
  const double length_s = ToSeconds(run.states.back().stamp_ns - run.states.front().stamp_ns);
  if (truth_path.empty()) return;
  const Trajectory truth = ReadTrajectory(truth_path);
  const double online_m = Ape(truth, online), adjusted_m = Ape(truth, adjusted);
  std::printf("%s: online %.4f, window %.4f, adjusted %.4f m, ratio %.2f; %.1f s CPU of %.0f s\n",
              folder.c_str(), online_m, Ape(truth, window), adjusted_m, adjusted_m / online_m,
              spent_s, length_s);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  using namespace slcmap;
  CLI::App app("Adjustment over all keyframes of a run");
  std::string run, truth, config, sequence, written;
  app.add_option("run", run)->required();
  app.add_option("--truth", truth);
  app.add_option("--config", config);
  app.add_option("--sequence", sequence, "whose images are looked at again");
  app.add_option("--write", written, "the adjusted trajectory");
  CLI11_PARSE(app, argc, argv);
  const MappingOptions options =
      config.empty() ? MappingOptions() : MappingOptions::FromYaml(config);
  Measure(run, truth, options.adjustment, sequence, written);
}
