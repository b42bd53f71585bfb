#include "mapping/merge/other_rig.h"

#include <Eigen/Geometry>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

constexpr double kSameCentre_m = 0.005, kSameDirection_rad = 0.0175;

}  // namespace

bool IsSameRig(const Rig& a, const Rig& b) {
  for (int i = 0; i < 2; ++i) {
    const RigidTransform T = a.T_imu_camera[i].Inverse() * b.T_imu_camera[i];
    if (T.translation.norm() > kSameCentre_m) return false;
    if (LogRotation(T.rotation).norm() > kSameDirection_rad) return false;
  }
  return true;
}

std::vector<LineSupport> SupportsInRig(const std::vector<LineSupport>& supports, const Rig& from,
                                       const Rig& to) {
  std::vector<LineSupport> moved;
  for (LineSupport support : supports) {
    const Camera &seen = from.cameras[support.camera], &other = to.cameras[support.camera];
    const Eigen::Quaterniond R = to.T_imu_camera[support.camera].rotation.conjugate() *
                                 from.T_imu_camera[support.camera].rotation;
    const auto move = [&](const Eigen::Vector2d& px) {
      const Eigen::Vector3d ray = R * PlaneFromPixel(seen, px).homogeneous();
      return PixelFromPlane(other, Eigen::Vector2d(ray.hnormalized()));
    };
    support.px = {move(support.px.start), move(support.px.end)};
    moved.push_back(support);
  }
  return moved;
}

}  // namespace slcmap
