// How well maps of one building are brought onto each other, against the truth of simulated
// recordings.
//
//   align_maps MAP1 TRUTH1 MAP2 TRUTH2
//
// TRUTH is the true trajectory of the map's recording, both in the world of the scene. Printed are
// how far places of the second map's trajectory are from where the truth has them in the first
// one's world (mean and most), the error of the turn, what agrees and the seconds.
// With VERBOSE in the environment each place that was looked at is told of.
#include "mapping/align/align_maps.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "apps/evaluation/trajectory_metrics.h"
#include "mapping/align/map_agreement.h"
#include "mapping/map/map_folder.h"

namespace slcmap {
namespace {

// The turn about z and translation from a map's world into that of its truth.
RigidTransform TruthFromMap(const MapResult& map, const char* truth) {
  const TrajectoryMetrics metrics = EvaluateTrajectory(ReadTrajectory(truth), map.trajectory, {});
  const Alignment& alignment = metrics.absolute.front().alignment;
  return alignment.T_truth_estimate;
}

int Main(char** argv) {
  const MapResult first = ReadMapFolder(argv[1]), second = ReadMapFolder(argv[3]);
  const RigidTransform truth =
      TruthFromMap(first, argv[2]).Inverse() * TruthFromMap(second, argv[4]);
  const auto start = std::chrono::steady_clock::now();
  const MapAlignment found = AlignMaps(first, second, AlignmentOptions());
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  double sum_m = 0, most_m = 0;
  for (const StampedPose& pose : second.trajectory) {
    const Eigen::Vector3d& p = pose.T_world_imu.translation;
    const double off_m = (found.T_first_second * p - truth * p).norm();
    sum_m += off_m;
    most_m = std::max(most_m, off_m);
  }
  const Eigen::Vector3d t = found.T_first_second.translation - truth.translation;
  std::printf(
      "off by %.1f mm mean, %.1f mm at most (%.1f %.1f %.1f mm), %.3f degrees; %.1f m2 and %.1f m "
      "agree, contradiction %.3f, rival %.2f; %.1f s\n",
      1e3 * sum_m / static_cast<double>(second.trajectory.size()), 1e3 * most_m, 1e3 * t.x(),
      1e3 * t.y(), 1e3 * t.z(),
      180 / std::numbers::pi * ComputeYaw(truth.Inverse() * found.T_first_second),
      found.surfaces_m2, found.lines_m, found.contradiction, found.rival_share, seconds.count());
  return 0;
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: align_maps MAP1 TRUTH1 MAP2 TRUTH2\n");
    return 2;
  }
  if (std::getenv("VERBOSE")) spdlog::set_level(spdlog::level::debug);
  try {
    return slcmap::Main(argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
