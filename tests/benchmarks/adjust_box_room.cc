// The adjustment of a flight through a bare rendered room, with its images: odometry once, whose
// run is kept in a folder, and the adjustment as often as wanted.
//
//   adjust_box_room FOLDER [--seconds S] [--config YAML] [--no-images]
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <filesystem>

#include "apps/evaluation/trajectory_metrics.h"
#include "data/simulator/motion.h"
#include "mapping/adjustment/adjustment.h"
#include "mapping/map/refinement.h"
#include "mapping/options.h"
#include "odometry/odometry.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {
namespace {

constexpr double kRest_s = 1, kRate_hz = 20, kWallDistance_m = 2.5, kPanel_m = 2;

RenderTask TaskOf(double duration_s) {
  RenderTask task{SmallRig(), ExampleFlight(SmallRig(), duration_s, kRest_s), {}};
  for (double t_s = 0.1; t_s < duration_s - 0.1; t_s += 1 / kRate_hz) task.times_s.push_back(t_s);
  return task;
}

OdometryRun Fly(const RenderTask& task, BoxRoomRenderer* renderer) {
  OdometryOptions options;
  options.points.min_distance_px = 10;
  options.keyframes.min_parallax_px = 10;
  Odometry odometry(task.rig, options, 1);
  ImuSimulatorOptions imu;
  imu.noise = task.rig.imu_noise;
  for (const ImuSample& sample : SimulateImu(task.motion, imu).samples) odometry.AddImu(sample);
  for (size_t i = 0; i < task.times_s.size(); ++i) {
    const RenderedPair pair = renderer->Render(static_cast<int>(i), false);
    odometry.AddStereo({ToNanoseconds(task.times_s[i]), pair.left, pair.right});
  }
  odometry.Finish();
  return odometry.Run();
}

// Renders the views of a run's keyframes again.
class RenderedViews final : public ViewImages {
 public:
  RenderedViews(const RenderTask& task, const OdometryRun& run, BoxRoomRenderer* renderer)
      : rig_(run.rectified_rig), renderer_(*renderer) {
    for (const Keyframe& keyframe : run.keyframes) {
      const auto at = std::ranges::min_element(task.times_s, {}, [&](double t_s) {
        return std::abs(t_s - ToSeconds(keyframe.stamp_ns));
      });
      frames_.push_back(static_cast<int>(at - task.times_s.begin()));
    }
    mask_.create(rig_.cameras[0].height_px, rig_.cameras[0].width_px, CV_8UC1);
    mask_.setTo(255);
  }
  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    const RenderedPair pair = renderer_.Render(frames_[view], false);
    return {0, pair.left, pair.right};
  }

 private:
  Rig rig_;
  BoxRoomRenderer& renderer_;
  std::vector<int> frames_;
  cv::Mat mask_;
};

double Ape(const Trajectory& truth, const Trajectory& estimate) {
  return EvaluateTrajectory(truth, estimate, {}, {}).absolute.front().position_m.rmse;
}

void Measure(const std::string& folder, double duration_s, const AdjustmentOptions& options,
             bool with_images) {
  const RenderTask task = TaskOf(duration_s);
  BoxRoomRenderer renderer(task, kWallDistance_m, kPanel_m);
  if (!std::filesystem::exists(folder + "/run.json")) {
    WriteRunFolder(folder, Fly(task, &renderer));
  }
  OdometryRun run = ReadRunFolder(folder);
  Trajectory truth, online;
  for (const double t_s : task.times_s) {
    truth.push_back({ToNanoseconds(t_s), task.motion.PoseAt(t_s)});
  }
  for (const OnlineState& state : run.states) online.push_back({state.stamp_ns, state.T_world_imu});
  std::map<std::string, int64_t> warnings;
  const Trajectory window = RefineTrajectory(run, &warnings);
  const RenderedViews views(task, run, &renderer);
  const std::clock_t start = std::clock();
  const AdjustmentResult result = Adjust(run, options, with_images ? &views : nullptr);
  const double spent_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  Apply(result, &run);
  const Trajectory adjusted = RefineTrajectory(run, &warnings);
  const AdjustmentFigures& f = result.figures;
  std::printf(
      "%ld keyframes, %ld points, %ld lines, %d iterations; %ld closures, %ld taken back, %ld "
      "points and %ld edges matched\nonline %.4f, window %.4f, adjusted %.4f m; %.1f s CPU\n",
      f.keyframes, f.points, f.lines, f.iterations, f.closures, f.closures_rejected,
      f.matched_points, f.matched_edges, Ape(truth, online), Ape(truth, window),
      Ape(truth, adjusted), spent_s);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  using namespace slcmap;
  CLI::App app("Adjustment of a flight through a rendered room");
  std::string folder, config;
  double duration_s = 40;
  bool no_images = false;
  app.add_option("folder", folder, "of the run")->required();
  app.add_option("--seconds", duration_s);
  app.add_option("--config", config);
  app.add_flag("--no-images", no_images);
  CLI11_PARSE(app, argc, argv);
  const MappingOptions options =
      config.empty() ? MappingOptions() : MappingOptions::FromYaml(config);
  Measure(folder, duration_s, options.adjustment, !no_images);
}
