// How well buildings are made of what maps hold: furnished floors, or a scene along a walk.
//   building_quality [OUT]             floors to make by, and floors that were kept out
//   building_quality OUT SCENE WALK    a scene's file, and a trajectory (TUM) through it
#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <filesystem>

#include "apps/evaluation/building_metrics.h"
#include "apps/evaluation/report.h"
#include "data/io/trajectory.h"
#include "mapping/building/build_building.h"
#include "tests/testing/furnished_floor.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap {
namespace {

struct Sums {
  int64_t rooms = 0, rooms_right = 0, openings = 0, found = 0, wrong = 0, walls = 0,
          walls_found = 0;

  void Add(const BuildingMetrics& m) {
    rooms += m.rooms;
    rooms_right += m.rooms_right;
    openings += m.openings;
    found += m.openings_found;
    wrong += m.openings_false;
    walls += m.walls;
    walls_found += m.walls_found;
  }
  void Print(const char* name) const {
    const double f1 = ComputeShare(2.0 * static_cast<double>(found),
                                   static_cast<double>(found + openings + wrong));
    fmt::print(
        "{:14} rooms right {} of {}; openings F1 {:.2f} ({} of {}, {} false); walls {} of {}\n",
        name, rooms_right, rooms, f1, found, openings, wrong, walls_found, walls);
    std::fflush(stdout);
  }
};

void Measure(const std::string& name, const std::string& out, const testing::MappedFloor& floor,
             Sums* sums) {
  const Building building = BuildBuilding(floor.input, {});
  const BuildingMetrics metrics = EvaluateBuilding(floor.truth, building);
  Sums one;
  one.Add(metrics);
  one.Print(name.c_str());
  if (sums != nullptr) sums->Add(metrics);
  if (out.empty()) return;
  std::filesystem::create_directories(out + "/" + name);
  WriteBuilding(out + "/" + name, building);
  WriteTrueBuilding(out + "/" + name + "/truth.json", floor.truth);
}

int Run(int argc, char** argv) {
  const std::string out = argc > 1 ? argv[1] : "";
  if (argc == 4) {
    std::vector<Eigen::Vector3d> walk;
    for (const StampedPose& pose : ReadTrajectory(argv[3])) {
      const Eigen::Vector3d& p = pose.T_world_imu.translation;
      if (walk.empty() || (p - walk.back()).norm() >= 0.3) walk.push_back(p);
    }
    Measure(std::filesystem::path(argv[2]).stem(), out, testing::MapFloor(ReadScene(argv[2]), walk),
            nullptr);
    return 0;
  }
  for (const bool kept_out : {false, true}) {
    const auto& kinds = kept_out ? testing::kFloorsKeptOut : testing::kFloorsToMakeBy;
    Sums sums;
    for (const std::string& kind : kinds) {
      for (const int seed : {1, 2, 3}) {
        const testing::FurnishedFloor floor = testing::MakeFurnishedFloor(kind, seed);
        Measure(kind + std::to_string(seed), out,
                testing::MapFloor(testing::SceneFromText(floor.yaml), floor.places), &sums);
      }
    }
    sums.Print(kept_out ? "kept out" : "all");
  }
  return 0;
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) { return slcmap::Run(argc, argv); }
