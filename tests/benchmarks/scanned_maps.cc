// Writes maps of short walks through one flat, each with noise, a way and a world of its own, to
// measure how merging grows with their number.
//
//   scanned_maps COUNT FOLDER; slcmap merge FOLDER/* -o MAP
//
// With TRUTH in place of COUNT, `scanned_maps TRUTH MAP` prints how far a merged map has each run
// from where it truly is, in the world of the first (mean and most).
#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "mapping/align/map_agreement.h"
#include "mapping/map/map_folder.h"
#include "tests/testing/scanned_map.h"

namespace slcmap {
namespace {

constexpr char kFlat[] = R"(
objects:
  - {kind: slab, at: [0, 0, 0], size: [14, 8], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [14, 8], material: ceiling, faces_down: true}
  - {kind: wall, points: [[0, 0], [14, 0], [14, 8], [0, 8]], closed: true, skirting_height: 0.09}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, doors: [[0, 1.2, 1.0, 2.1, 90]]}
  - {kind: wall, points: [[9, 0], [9, 4]], has_back: true, doors: [[0, 2.2, 1.0, 2.1, 90]]}
  - {kind: wall, points: [[0, 4], [14, 4]], has_back: true, doors: [[0, 2, 1.0, 2.1, 90], [0, 10.5, 1.0, 2.1, 90]]}
  - {kind: box, at: [0.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.2, 0.4, 0], size: [1.2, 0.6, 0.75]}
  - {kind: box, at: [8.2, 0.6, 0], size: [0.6, 1.0, 1.1]}
  - {kind: box, at: [12.4, 3.6, 0.9], size: [1.0, 0.3, 0.9]}
  - {kind: box, at: [6.4, 7.6, 0], size: [1.6, 0.5, 2.0]}
  - {kind: box, at: [12.5, 5.5, 0], size: [0.9, 0.9, 0.75]}
)";

// Where the world of a map is in the scene's.
RigidTransform WorldOfMap(int number) {
  std::mt19937 generator(static_cast<unsigned>(number));
  std::uniform_real_distribution<double> turn(-3.1, 3.1), shift(-5, 5);
  return LevelTransform(turn(generator),
                        {shift(generator), shift(generator), 0.1 * shift(generator)});
}

// From one of ten places on, over five more.
testing::Way WayOfMap(int number) {
  std::mt19937 generator(static_cast<unsigned>(1000 + number));
  std::uniform_real_distribution<double> beside(-0.5, 0.5);
  const testing::Way places = {{2.5, 1.5, 1.5}, {4.4, 1.7, 1.5}, {6.5, 2, 1.5},  {8.3, 2.7, 1.5},
                               {11, 2.5, 1.5},  {11, 3.5, 1.5},  {11, 5.5, 1.5}, {7, 6, 1.5},
                               {3, 5.5, 1.5},   {2.5, 4.6, 1.5}};
  testing::Way way;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t at = static_cast<std::size_t>(number) * 3 % 5 + i;
    way.push_back(places[at] + Eigen::Vector3d(beside(generator), 0.5 * beside(generator), 0));
  }
  return way;
}

void AddNoise(int number, MapResult* map) {
  std::mt19937 generator(static_cast<unsigned>(2000 + number));
  std::normal_distribution<double> noise;
  for (DensePoint& point : map->dense)
    point.p_world += 0.004 * noise(generator) * point.normal_world;
  for (MapLine& line : map->lines) {
    const Eigen::Vector3d off(noise(generator), noise(generator), noise(generator));
    line.start_world += 0.002 * off;
    line.end_world += 0.002 * off;
  }
}

int Write(int count, const std::string& folder) {
  const Scene scene = testing::SceneFromText(kFlat);
  for (int i = 0; i < count; ++i) {
    MapResult map = testing::ScannedMap(scene, WayOfMap(i), WorldOfMap(i), fmt::format("run{}", i));
    AddNoise(i, &map);
    WriteMapFolder(fmt::format("{}/m{:03}", folder, i), map);
  }
  return 0;
}

int CompareWithTruth(const std::string& folder) {
  const MapSource source = MapSourceIn(folder);
  double sum_m = 0, most_m = 0;
  const RigidTransform T_world_scene = WorldOfMap(std::atoi(source.run_id.c_str() + 3));
  for (const MergedRun& run : source.merged) {
    const int number = std::atoi(run.run_id.c_str() + 3);
    const Eigen::Vector3d p = WorldOfMap(number) * WayOfMap(number).front(),
                          truth = T_world_scene * WayOfMap(number).front();
    const double off_m = (run.T_world_run * p - truth).norm();
    sum_m += off_m;
    most_m = std::max(most_m, off_m);
  }
  std::printf("%zu runs, off by %.1f mm mean, %.1f mm at most\n", source.merged.size(),
              1e3 * sum_m / static_cast<double>(source.merged.size()), 1e3 * most_m);
  return 0;
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  if (std::string(argv[1]) == "TRUTH") return slcmap::CompareWithTruth(argv[2]);
  return slcmap::Write(std::atoi(argv[1]), argv[2]);
}
