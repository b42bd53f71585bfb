// Maps of made scenes as a perfect rig would measure them: quick to have, unlike those of images.
#pragma once

#include <string>
#include <vector>

#include "mapping/align/map_agreement.h"
#include "mapping/map/map.h"
#include "mapping/options.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap::testing {

inline constexpr int64_t kScanStep_ns = 50'000'000;  // between poses

using Way = std::vector<Eigen::Vector3d>;  // waypoints

// What is seen of a scene from places along some ways, in a world that T_map_scene leads to. Stamps
// start at first_ns.
inline MapResult ScannedAlong(const Scene& scene, const std::vector<Way>& ways,
                              const RigidTransform& T_map_scene = {}, const std::string& run = "a",
                              int64_t first_ns = 1'000'000'000) {
  ScanOptions options;
  options.rays = 4000;
  std::vector<Eigen::Vector3d> places;
  for (const Way& way : ways) {
    const std::vector<Eigen::Vector3d> along = PlacesAlong(way);
    places.insert(places.end(), along.begin(), along.end());
  }
  const BuildingInput seen = Scan(scene, places, options);
  MapResult map;
  map.method = "slc";
  map.complete = true;
  map.source.run_id = run;
  map.source.options = MappingOptions().ToYaml();
  map.rectified_rig.cameras.assign(2, PinholeCamera(752, 480, 430, 376, 240));
  for (RigidTransform& T : map.rectified_rig.T_imu_camera) {  // looking along x
    T.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  }
  map.rectified_rig.T_imu_camera[1].translation.y() = -0.11;
  for (const SurfacePoint& point : seen.points) {
    map.dense.push_back({T_map_scene * point.p_world, T_map_scene.rotation * point.normal_world,
                         point.sigma_m, 128});
  }
  for (MapLine line : seen.lines) {
    line.start_world = T_map_scene * line.start_world;
    line.end_world = T_map_scene * line.end_world;
    line.observations = 5;
    line.kind = LineKind::kEdge;
    map.lines.push_back(line);
  }
  std::vector<RayBundle> rays;
  for (const ViewRays& view : seen.rays) {
    RayBundle bundle{T_map_scene * view.p_world_camera, {}};
    for (const Eigen::Vector3f& p : view.p_world) {
      bundle.p_world.push_back(T_map_scene * p.cast<double>());
    }
    rays.push_back(bundle);
  }
  map.occupancy.Insert(rays, 20);
  for (size_t i = 0; i < places.size(); ++i) {
    const int64_t stamp_ns = first_ns + static_cast<int64_t>(i) * kScanStep_ns;
    // Each looks somewhere else.
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(1.1 * static_cast<double>(i), Eigen::Vector3d::UnitZ()));
    map.trajectory.push_back({stamp_ns, T_map_scene * RigidTransform(turn, places[i])});
  }
  map.keyframes = map.trajectory;
  return map;
}

inline MapResult ScannedMap(const Scene& scene, const Way& way,
                            const RigidTransform& T_map_scene = {}, const std::string& run = "a",
                            int64_t first_ns = 1'000'000'000) {
  return ScannedAlong(scene, {way}, T_map_scene, run, first_ns);
}

}  // namespace slcmap::testing
