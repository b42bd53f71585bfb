// slcmap simulate: a recorded sequence of a building that does not exist.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/convert.h"
#include "apps/commands/progress.h"
#include "data/io/yaml.h"
#include "data/rig/profile.h"
#include "data/simulator/renderer.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/simulation.h"
#include "data/source/convert_recording.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  slcmap simulate config/scenes/office_corridor.yaml -o corridor
      walks the way that the scene describes, with EuRoC's rig
  slcmap simulate config/scenes/machine_hall.yaml -o hall --trajectory MH_04.txt --duration 60
      flies along a part of a recorded trajectory (TUM format, body = IMU)
  slcmap simulate config/scenes/office_floor.yaml -o office --rig tumvi --time-offset-s 0.012
      with TUM VI's fisheye rig, whose camera clock is 12 ms behind the IMU's
  slcmap simulate config/scenes/office_corridor.yaml -o crooked --inexact 1 --inexact-seed 2
      the same building as builders leave it: walls bend, fittings are turned
  slcmap simulate config/scenes/office_corridor.yaml -o walk.mcap --as realsense
      a bag as the driver of a RealSense writes it: topics, frames, rectified images, camera_info

It writes a EuRoC folder (mav0) and beside it what is true (truth): trajectory.tum, rig.yaml, the
scene's edges with the parts that the cameras saw, its walls and rooms, and depth images with
--depth.)";

struct SimulateArguments {
  SimulationOptions simulation;
  std::optional<double> exposure_ms;
  std::optional<double> inexact;  // instead of what the scene says
  std::optional<int> inexact_seed;
  std::string as;  // a profile
  bool without_image_noise = false;
};

RendererOptions MakeRendererOptions(const SimulateArguments& arguments) {
  const SimulationOptions& options = arguments.simulation;
  RendererOptions renderer;
  renderer.camera = ReadSceneCamera(options.scene);
  if (arguments.exposure_ms) renderer.camera.exposure_ms = *arguments.exposure_ms;
  renderer.camera.seed = static_cast<uint32_t>(options.seed);
  renderer.camera.with_noise = !arguments.without_image_noise;
  renderer.light.threads = options.threads;
  return renderer;
}

InexactOptions MakeInexactOptions(const SimulateArguments& arguments) {
  InexactOptions inexact = ReadSceneInexact(arguments.simulation.scene);
  if (arguments.inexact) inexact.amount = *arguments.inexact;
  if (arguments.inexact_seed) inexact.seed = *arguments.inexact_seed;
  inexact.Check();
  return inexact;
}

std::unique_ptr<PairRenderer> MakeRenderer(const SimulateArguments& arguments,
                                           const RenderTask& task) {
  const std::string& path = arguments.simulation.scene;
  const RendererOptions options = MakeRendererOptions(arguments);
  const Scene scene =
      ReadScene(path, task.Stage("reading the scene"), MakeInexactOptions(arguments));
  const WayCrossings crossings = CheckWay(scene, task);
  if (crossings.count > 0) {
    const Eigen::Vector3d& place = crossings.first_place_m;
    spdlog::warn(
        "{}: the left camera passes through surfaces {} times, first at ({:.2f}, {:.2f}, {:.2f}) "
        "m, "
        "{:.2f} s into the motion",
        path, crossings.count, place.x(), place.y(), place.z(), crossings.first_s);
  }
  return MakeSceneRenderer(scene, options, task);
}

// Into a folder, for an output of a name. Returns the number of pairs.
int SimulateFolder(const SimulateArguments& arguments, const std::string& output) {
  const SimulationOptions& options = arguments.simulation;
  const ProcessCost before = CostSoFar();
  std::optional<ProgressBar> bar;
  const SimulationState summary = Simulate(
      options, [&](const RenderTask& task) { return MakeRenderer(arguments, task); },
      [&](const SimulationState& state) {
        if (!bar) bar.emplace("simulating");
        bar->Update(state.pairs, state.planned_pairs, state.data_s, state.distance_m);
        return !Interrupted();
      },
      StageProgress);
  bar.reset();
  if (summary.pairs < summary.planned_pairs) {
    spdlog::warn("{}: interrupted, {} of {} pairs are written", output, summary.pairs,
                 summary.planned_pairs);
  }
  const double cpu_s = CostSoFar().cpu_s - before.cpu_s;
  spdlog::info("{}: {} pairs, {:.1f} s, {:.1f} m; {:.3f} s of CPU a pair", output, summary.pairs,
               summary.data_s, summary.distance_m, cpu_s / std::max(summary.pairs, 1));
  if (options.with_depth && summary.pairs > 0) {
    spdlog::info("the nearest surface is {:.2f} m away, in pair {}", summary.nearest_m,
                 summary.nearest_pair);
  }
  return summary.pairs;
}

const RigProfile& ProfileNamed(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& [known, profile] : KnownProfiles()) names.push_back(known);
  const auto found = KnownProfiles().find(name);
  if (found != KnownProfiles().end()) return found->second;
  throw ConfigError(fmt::format("--as: found {}, expected one of {}{}", name,
                                fmt::join(names, ", "), DidYouMean(name, names)));
}

// As the rig's driver would have recorded what is simulated.
void SimulateBag(SimulateArguments arguments, const BagPacking& packing) {
  SimulationOptions& options = arguments.simulation;
  const std::string path = options.folder;
  const std::string truth = fs::path(path).replace_extension("").string() + "_truth";
  if (fs::exists(truth)) {
    throw ConfigError(
        fmt::format("output {}: found something there, expected nothing: remove it, or "
                    "name another",
                    truth));
  }
  MakeOutputBag(path, packing, options.scene, [&](const std::string& at) {
    options.folder = at + ".sequence";
    if (SimulateFolder(arguments, path) == 0) throw StoppedError(path + ": interrupted");
    const auto recording = OpenTables(options.folder, {});
    Warnings warnings;
    const Rig rig = recording->FindCalibration({}, {}, &warnings).rig;
    const RigLayout layout =
        options.profile == nullptr ? RigLayout{.rig = rig} : LayoutFor(*options.profile, rig);
    WriteBagRecording(*recording, {}, packing, false, at, StageProgress("bag"), layout);
    fs::rename(options.folder + "/truth", truth);
  });
  spdlog::info("wrote {}, and {} with what is true", path, truth);
}

void RunSimulate(SimulateArguments arguments) {
  SimulationOptions& options = arguments.simulation;
  if (!arguments.as.empty()) options.profile = &ProfileNamed(arguments.as);
  const BagPacking packing = ParsePacking(options.folder, "");
  if (packing.form != kFolder) return SimulateBag(arguments, packing);
  if (options.profile != nullptr) {
    throw ConfigError("--as: found it with the folder " + options.folder +
                      ", expected an -o that ends with .bag, .mcap or .db3");
  }
  SimulateFolder(arguments, options.folder);
}

void AddMotionOptions(SimulationOptions& options, CLI::App* command) {
  command->add_option("--trajectory", options.trajectory,
                      "TUM or EuRoC file to move along, instead of the scene's own way");
  command->add_option("--from", options.from_s, "Start so many seconds into the motion");
  command->add_option("--duration", options.duration_s, "Seconds to simulate; 0: to the end");
}

void AddBuildingOptions(SimulateArguments& arguments, CLI::App* command) {
  command->add_option("--inexact", arguments.inexact,
                      "How far walls and fittings are from plumb and parallel; 1: as far as "
                      "building tolerances let pass; the scene's own without it");
  command->add_option("--inexact-seed", arguments.inexact_seed,
                      "Of these deviations; the scene's own without it");
}

void AddSensorOptions(SimulateArguments& arguments, CLI::App* command) {
  SimulationOptions& options = arguments.simulation;
  command
      ->add_option("--rig", options.rig,
                   "euroc, tumvi, four_cameras, three_cameras, or a file in their form")
      ->capture_default_str();
  command->add_option("--imu", options.imu,
                      "adis16448, bmi160, phone or perfect; the rig's own without it");
  command
      ->add_option("--imu-scale", options.imu_scale,
                   "Share by which accelerometer and gyroscope read too much, such as 0.03, or two "
                   "numbers; told in truth/rig.yaml, not in mav0")
      ->expected(1, 2);
  command->add_option("--imu-axes-deg", options.imu_axes_deg,
                      "How far the IMU's axes are off their directions; told as --imu-scale is");
  command->add_option("--rate", options.image_rate_hz, "Stereo pairs a second")
      ->capture_default_str();
  command->add_option("--time-offset-s", options.time_offset_s,
                      "Stamp on the IMU's clock minus stamp on the camera's; not told in mav0");
  command->add_option("--right-offset-s", options.right_offset_s,
                      "The right image is taken so much later, and stamped so");
  command->add_option("--readout-s", options.readout_s,
                      "Rolling shutter: the last row is exposed so much after the first");
  command->add_option("--wrong-calibration", options.miscalibration,
                      "Tell a calibration in mav0 that is wrong; 1: as a careless one");
  command->add_option("--exposure-ms", arguments.exposure_ms,
                      "Fixed exposure; 0: automatic; the scene's own without it");
  command->add_flag("--without-image-noise", arguments.without_image_noise,
                    "Neither photon nor read noise");
}

}  // namespace

void AddSimulateCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("simulate", "Render a sequence of a described building");
  const auto arguments = std::make_shared<SimulateArguments>();
  SimulationOptions& options = arguments->simulation;
  command->add_option("scene", options.scene, "Description of the building (YAML)")
      ->type_name("SCENE")
      ->required();
  command
      ->add_option("-o,--output", options.folder,
                   "Folder of the sequence, new; or a bag by its ending: .bag, .db3, .mcap")
      ->type_name("SEQ")
      ->required();
  AddMotionOptions(options, command);
  AddBuildingOptions(*arguments, command);
  AddSensorOptions(*arguments, command);
  command
      ->add_option("--as", arguments->as,
                   "Write the bag as the driver of this rig would, one of config/profiles")
      ->type_name("PROFILE");
  command
      ->add_option("--emitter", options.emitter,
                   "Dots as a depth camera throws them: off, steady, or alternating with every "
                   "other image")
      ->capture_default_str();
  command->add_flag("--depth", options.with_depth, "Write truth/depth for each left image");
  command->add_option("--threads", options.threads, "Threads; the bytes are the same with any")
      ->capture_default_str();
  command->add_option("--seed", options.seed, "Of all noise")->capture_default_str();
  command->footer(kExamples);
  command->callback([arguments] { RunSimulate(*arguments); });
}

}  // namespace slcmap::commands
