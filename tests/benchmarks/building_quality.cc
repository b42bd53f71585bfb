// How well walls, openings and rooms of a simulated building are found from what a perfect rig
// would measure along the scene's own way, with made noise.
//
//   building_quality SCENE.yaml [--inexact A] [--seed N] [--noise M] [--noise-per-m M] [--drift M]
//       [--half-width-deg D] [--lowest-deg D] [--highest-deg D] [--rays N] [--plot FILE.svg]
//       [--output FOLDER]
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "apps/evaluation/building_metrics.h"
#include "data/simulator/made_motion.h"
#include "mapping/building/build_building.h"
#include "mapping/map/building.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap {
namespace {

struct Arguments {
  std::string scene, plot, output;
  InexactOptions inexact;
  testing::ScanOptions scan;
  double drift_m = 0;
};

std::vector<Eigen::Vector3d> Waypoints(const std::string& path) {
  YamlSection scene = YamlSection::FromFile(path);
  MadeMotionOptions options;
  options.Read(scene.Section("trajectory"));
  return options.waypoints_m;
}

void Run(Arguments arguments) {
  arguments.scan.drift_m = {arguments.drift_m, arguments.drift_m, 0};
  const Scene scene = ReadScene(arguments.scene, {}, arguments.inexact);
  const std::vector<Eigen::Vector3d> places = testing::PlacesAlong(Waypoints(arguments.scene), 0.2);
  const BuildingInput input = testing::Scan(scene, places, arguments.scan);
  const TrueBuilding truth = testing::SeenFrom(scene, places, arguments.scan);
  const auto begin = std::chrono::steady_clock::now();
  const Building building = BuildBuilding(input, {});
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
  std::printf("%zu points, %zu lines, %zu views; %.2f s\n", input.points.size(), input.lines.size(),
              input.rays.size(), spent.count());
  for (const Storey& storey : building.storeys) {
    std::printf("storey %.3f to %.3f m\n", storey.floor_m, storey.ceiling_m.value_or(-1));
  }
  const BuildingMetrics metrics = EvaluateBuilding(truth, building);
  std::fputs(BuildingTable({"building", arguments.scene}, metrics).c_str(), stdout);
  if (!arguments.plot.empty()) WriteBuildingPlan(arguments.plot, truth, building);
  if (!arguments.output.empty()) WriteBuilding(arguments.output, building);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  slcmap::Arguments arguments;
  CLI::App app("Buildings from made measurements");
  app.add_option("scene", arguments.scene)->required();
  app.add_option("--inexact", arguments.inexact.amount);
  app.add_option("--seed", arguments.inexact.seed);
  app.add_option("--noise", arguments.scan.noise_m);
  app.add_option("--noise-per-m", arguments.scan.noise_per_m);
  app.add_option("--half-width-deg", arguments.scan.half_width_deg);
  app.add_option("--rays", arguments.scan.rays);
  app.add_option("--lowest-deg", arguments.scan.lowest_deg);
  app.add_option("--highest-deg", arguments.scan.highest_deg);
  app.add_option("--drift", arguments.drift_m);
  app.add_option("--plot", arguments.plot);
  app.add_option("--output", arguments.output);
  CLI11_PARSE(app, argc, argv);
  slcmap::Run(arguments);
  return 0;
}
