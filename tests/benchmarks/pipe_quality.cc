// Finds the pipes of a map anew, among the lines that it has, and compares them with the true ones:
// within seconds, where mapping again takes minutes.
//
//   pipe_quality MAP SEQ    a map made with `mapping: {pipes: {find: false}}`, and its sequence
#include <chrono>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/evaluation/building_metrics.h"
#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/core/error.h"
#include "mapping/map/map_folder.h"
#include "mapping/pipes/pipes.h"

namespace slcmap {
namespace {

void Print(const MapPipe& pipe, bool is_true) {
  const Eigen::Vector3d &a = pipe.start_world, &b = pipe.end_world;
  std::printf("%s radius %.4f m, (%.2f, %.2f, %.2f) to (%.2f, %.2f, %.2f), %d images\n",
              is_true ? "true " : "false", pipe.radius_m, a.x(), a.y(), a.z(), b.x(), b.y(), b.z(),
              pipe.images);
}

void Measure(const std::string& folder, const std::string& sequence) {
  const MapResult map = ReadMapFolder(folder);
  const TrajectoryMetrics trajectory =
      EvaluateTrajectory(ReadTrajectory(sequence + "/truth/trajectory.tum"), map.trajectory, {});
  const auto start = std::chrono::steady_clock::now();
  const FoundPipes found = FindPipes(map, PipeOptions());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const ComparedFiles inputs{sequence + "/truth/pipes.csv", folder};
  const std::vector<TruePipe> truth = ReadTruePipes(inputs.truth);
  const std::vector<MapPipe> pipes = Aligned(trajectory.absolute.front().alignment, found.pipes);
  for (const MapPipe& pipe : pipes) {
    Print(pipe, EvaluatePipes(truth, {pipe}).false_pipes == 0);
  }
  std::cout << FiguresText(PipeJson(inputs, EvaluatePipes(truth, pipes)));
  std::printf("lines     %zu are explained by them; %.2f s\n", found.line_ids.size(), took.count());
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: pipe_quality MAP SEQ\n";
    return 2;
  }
  try {
    slcmap::Measure(argv[1], argv[2]);
  } catch (const slcmap::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
