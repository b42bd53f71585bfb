#include "mapping/planes/plane_watch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinDepth_m = 0.3;  // of a place from a camera
constexpr double kMargin_px = 2;     // of the image's border

}  // namespace

PlaneWatch::PlaneWatch(const ViewCameras& cameras, const std::vector<SightDepths>& depths,
                       const PlaneOptions& options)
    : cameras_(cameras),
      depths_(depths),
      max_range_m_(options.max_range_m),
      min_cosine_(std::cos(options.max_grazing_deg * std::numbers::pi / 180)) {
  for (size_t view = 0; view < cameras_.T_camera_world.size(); ++view) {
    centres_.push_back(cameras_.Centre(static_cast<int>(view)));
  }
}

bool PlaneWatch::Sees(const Vector3d& p_world, const Vector3d& normal_world) {
  const int count = static_cast<int>(centres_.size());
  for (int i = 0; i < count; ++i) {
    const int view = (last_ + i) % count;
    if (!SeesFrom(view, p_world, normal_world)) continue;
    last_ = view;
    return true;
  }
  return false;
}

bool PlaneWatch::SeesFrom(int view, const Vector3d& p_world, const Vector3d& normal_world) const {
  const Vector3d way = centres_[view] - p_world;
  const double range_m = way.norm();
  if (range_m > max_range_m_ || normal_world.dot(way) < min_cosine_ * range_m) return false;
  const RigidTransform& T_camera_world = cameras_.T_camera_world[view][0];
  const Vector3d p_camera = T_camera_world * p_world;
  if (p_camera.z() < kMinDepth_m) return false;
  const Camera& camera = cameras_.cameras[0];
  const Vector2d px = PixelFromPlane(camera, Vector2d(p_camera.hnormalized()));
  if (!camera.Contains(px, kMargin_px)) return false;
  const Vector3d normal_camera = T_camera_world.rotation * normal_world;
  return std::ranges::none_of(depths_, [&](const SightDepths& depths) {
    return depths.HidesSurface(view, 0, camera, p_camera, normal_camera);
  });
}

}  // namespace slcmap
