#include "mapping/merge/other_rig.h"

#include <Eigen/Geometry>
#include <array>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

constexpr double kSameCentre_m = 0.005, kSameDirection_rad = 0.0175;

// From a camera's images into those of another one in the same place.
struct PixelMove {
  Camera from, to;
  Eigen::Quaterniond R_to_from;

  Eigen::Vector2d At(const Eigen::Vector2d& px) const {
    const Eigen::Vector3d ray = R_to_from * PlaneFromPixel(from, px).homogeneous();
    return PixelFromPlane(to, Eigen::Vector2d(ray.hnormalized()));
  }
};

std::array<PixelMove, 2> MovesBetween(const Rig& from, const Rig& to) {
  const auto move = [&](int camera) {
    return PixelMove{
        from.cameras[camera], to.cameras[camera],
        to.T_imu_camera[camera].rotation.conjugate() * from.T_imu_camera[camera].rotation};
  };
  return {move(0), move(1)};
}

}  // namespace

bool IsSameRig(const Rig& a, const Rig& b) {
  for (int i = 0; i < 2; ++i) {
    const RigidTransform T = a.T_imu_camera[i].Inverse() * b.T_imu_camera[i];
    if (T.translation.norm() > kSameCentre_m) return false;
    if (LogRotation(T.rotation).norm() > kSameDirection_rad) return false;
  }
  return true;
}

std::vector<LineSupport> SupportsInRig(std::vector<LineSupport> supports, const Rig& from,
                                       const Rig& to) {
  const std::array<PixelMove, 2> moves = MovesBetween(from, to);
  for (LineSupport& support : supports) {
    const PixelMove& move = moves[support.camera];
    support.px = {move.At(support.px.start), move.At(support.px.end)};
  }
  return supports;
}

std::vector<MapPointObservation> ObservationsInRig(std::vector<MapPointObservation> observations,
                                                   const Rig& from, const Rig& to) {
  const std::array<PixelMove, 2> moves = MovesBetween(from, to);
  for (MapPointObservation& seen : observations) seen.px = moves[seen.camera].At(seen.px);
  return observations;
}

}  // namespace slcmap
