// Maps of made scenes as a perfect rig would measure them: quick to have, unlike those of images.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "mapping/map.h"
#include "mapping/merge/alignment_features.h"
#include "mapping/options.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap::testing {

inline constexpr int64_t kScanStep_ns = 50'000'000;  // between poses

// What is seen of a scene from places along a way, in a world that T_map_scene leads to. Stamps
// start at first_ns.
inline MapResult ScannedMap(const Scene& scene, const std::vector<Eigen::Vector3d>& waypoints,
                            const RigidTransform& T_map_scene = {}, const std::string& run = "a",
                            int64_t first_ns = 1'000'000'000) {
  ScanOptions options;
  options.rays = 4000;
  const std::vector<Eigen::Vector3d> places = PlacesAlong(waypoints);
  const BuildingInput seen = Scan(scene, places, options);
  MapResult map;
  map.method = "slc";
  map.complete = true;
  map.source.run_id = run;
  map.source.options = MappingOptions().ToYaml();
  for (Camera& camera : map.rectified_rig.cameras) {
    camera.width_px = 752;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 430;
    camera.cx_px = 376;
    camera.cy_px = 240;
  }
  map.rectified_rig.T_imu_camera[1].translation.x() = 0.11;
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
  for (const Sights& sights : seen.sights) {
    RayBundle bundle{T_map_scene * sights.p_world_camera, {}};
    for (const Eigen::Vector3f& p : sights.p_world) {
      bundle.p_world.push_back(T_map_scene * p.cast<double>());
    }
    rays.push_back(bundle);
  }
  map.occupancy.Insert(rays, 20);
  for (size_t i = 0; i < places.size(); ++i) {
    const int64_t stamp_ns = first_ns + static_cast<int64_t>(i) * kScanStep_ns;
    map.trajectory.push_back({stamp_ns, T_map_scene * RigidTransform({}, places[i])});
    map.trajectory.back().T_world_imu.rotation = T_map_scene.rotation;
    if (i % 4 == 0) map.keyframes.push_back(map.trajectory.back());
  }
  return map;
}

}  // namespace slcmap::testing
