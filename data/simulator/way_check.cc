#include "data/simulator/way_check.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "data/error.h"
#include "data/simulator/glass_panes.h"
#include "data/simulator/ray_scene.h"

namespace slcmap {
namespace {

constexpr double kStep_s = 0.05;
constexpr float kHeadroom_m = 10;  // a scene may have no ceiling

Eigen::AlignedBox3f BoundsOf(const Scene& scene) {
  Eigen::AlignedBox3f bounds;
  for (const ScenePatch& patch : SeenPatches(scene)) {
    for (const Eigen::Vector3f& p : patch.corners) bounds.extend(p);
  }
  bounds.max().z() += kHeadroom_m;
  return bounds;
}

std::string Shown(const Eigen::Vector3f& p) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z());
}

}  // namespace

WayCrossings CheckWay(const Scene& scene, const RenderTask& task) {
  const Progress progress = task.Stage("following the way");
  const Eigen::AlignedBox3f bounds = BoundsOf(scene);
  const RayScene rays(SeenPatches(scene));
  std::optional<GlassPanes> panes;
  if (!scene.panes.empty()) panes.emplace(scene.panes);
  WayCrossings crossings;
  Eigen::Vector3f before = Eigen::Vector3f::Zero();
  const double first_s = task.times_s.front(), last_s = task.times_s.back();
  const auto steps = static_cast<int64_t>((last_s - first_s) / kStep_s) + 1;
  for (int64_t i = 0; i <= steps; ++i) {
    if (i % 256 == 0)
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(steps + 1));
    const double t_s = std::min(first_s + static_cast<double>(i) * kStep_s, last_s);
    const RigidTransform T_world_left = task.motion.PoseAt(t_s) * task.rig.T_imu_camera[0];
    const Eigen::Vector3f place = T_world_left.translation.cast<float>();
    if (!bounds.contains(place)) {
      throw ConfigError(fmt::format(
          "simulate: {:.2f} s into the motion the left camera is at {} m, outside the building, "
          "expected it between {} and {}",
          t_s, Shown(place), Shown(bounds.min()), Shown(bounds.max())));
    }
    if (i > 0 &&
        (rays.Blocked(before, place - before, 1) || (panes && panes->Between(before, place)))) {
      if (crossings.count++ == 0) {
        crossings.first_s = t_s;
        crossings.first_place_m = place.cast<double>();
      }
    }
    before = place;
  }
  return crossings;
}

}  // namespace slcmap
