#include "mapping/lines/known_lines.h"

#include <cmath>
#include <map>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

int AxisOf(const Line& line, const std::vector<BuildingAxis>& axes) {
  for (size_t i = 0; i < axes.size(); ++i) {
    if (axes[i].axis != line.axis) continue;
    if (line.axis == LineAxis::kVertical || axes[i].world == line.world) return static_cast<int>(i);
  }
  return -1;
}

// Segments run with the bright side on their left: the keyframe's tells which way the line does.
bool RunsAlong(const Line& line, const Keyframe& keyframe, const LineObservation& observation,
               const Rig& rig) {
  const RigidTransform T_camera_world = (keyframe.T_world_imu * rig.T_imu_camera[0]).Inverse();
  const Eigen::Vector3d start = T_camera_world * line.start_world;
  const Eigen::Vector3d end = T_camera_world * line.end_world;
  if (start.z() < 0.05 || end.z() < 0.05) return true;
  const Eigen::Vector2d along = end.hnormalized() - start.hnormalized();
  return along.dot(observation.left_px.end - observation.left_px.start) >= 0;
}

// How many keyframes see each line the way that it runs, less those that see it the other way.
std::map<int64_t, int> Senses(const OdometryRun& run) {
  std::map<int64_t, const Line*> lines;
  for (const Line& line : run.lines) lines[line.id] = &line;
  std::map<int64_t, int> senses;
  for (const Keyframe& keyframe : run.keyframes) {
    for (const LineObservation& observation : keyframe.lines) {
      const auto found = lines.find(observation.id);
      if (found == lines.end()) continue;
      senses[observation.id] +=
          RunsAlong(*found->second, keyframe, observation, run.rectified_rig) ? 1 : -1;
    }
  }
  return senses;
}

}  // namespace

std::vector<TrackedLine> KnownLines(const OdometryRun& run, const std::vector<BuildingAxis>& axes,
                                    double max_sigma_m, int min_views) {
  std::map<int64_t, int> senses = Senses(run);
  std::vector<TrackedLine> known;
  for (const Line& line : run.lines) {
    const Eigen::Vector3d along = line.end_world - line.start_world;
    const double sigma_m = std::sqrt(line.covariance_m2.trace());
    if (along.norm() < 0.05 || sigma_m > max_sigma_m || line.observations < min_views) continue;
    TrackedLine tracked;
    tracked.axis = AxisOf(line, axes);
    tracked.segment = line.segment;
    const double sense = senses[line.id] < 0 ? -1 : 1;
    tracked.line = {0.5 * (line.start_world + line.end_world), sense * along.normalized()};
    tracked.seen = {-0.5 * along.norm(), 0.5 * along.norm()};
    known.push_back(tracked);
  }
  return known;
}

}  // namespace slcmap
