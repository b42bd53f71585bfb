#include "export/model_images.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <set>

namespace slcmap {
namespace {

// Keyframes and the poses at which lines were seen, by stamp.
std::map<int64_t, RigidTransform> PosesOf(const MapResult& map) {
  std::map<int64_t, RigidTransform> poses;
  for (const StampedPose& pose : map.keyframes) poses[pose.stamp_ns] = pose.T_world_imu;
  std::set<int64_t> seen_ns;
  for (const LineSupport& support : map.line_evidence.supports) seen_ns.insert(support.stamp_ns);
  for (const StampedPose& pose : map.trajectory) {
    if (seen_ns.contains(pose.stamp_ns)) poses.emplace(pose.stamp_ns, pose.T_world_imu);
  }
  return poses;
}

}  // namespace

bool IsCalibrated(const Camera& camera) {
  return camera.fx_px > 0 && camera.fy_px > 0 && camera.width_px > 0 && camera.height_px > 0;
}

std::vector<ModelImage> ModelImages(const MapResult& map) {
  const Rig& rig = map.rectified_rig;
  std::vector<ModelImage> images;
  for (const auto& [stamp_ns, T_world_imu] : PosesOf(map)) {
    for (int i = 0; i < 2; ++i) {
      if (!IsCalibrated(rig.cameras[i])) continue;
      images.push_back({static_cast<int>(images.size()) + 1, stamp_ns, i,
                        (T_world_imu * rig.T_imu_camera[i]).Inverse(),
                        fmt::format("cam{}/data/{}.png", i, stamp_ns)});
    }
  }
  return images;
}

}  // namespace slcmap
