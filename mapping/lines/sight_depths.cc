#include "mapping/lines/sight_depths.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/watched_loop.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

constexpr int kCell_px = 8;
constexpr double kMinDepth_m = 0.2, kMaxDepth_m = 10;
// A surface this much nearer than a line hides it: an edge is on its surfaces, whose points lie up
// to a voxel beside it and are seen at an angle.
constexpr double kClearance_m = 0.12, kClearanceShare = 0.04;

}  // namespace

SightDepths::SightDepths(const std::vector<DensePoint>& cloud, double size_m,
                         const ViewCameras& views, const Progress& progress)
    : size_m_(size_m),
      columns_((views.cameras[0].width_px + kCell_px - 1) / kCell_px),
      rows_((views.cameras[0].height_px + kCell_px - 1) / kCell_px),
      images_(views.T_camera_world.size()) {
  constexpr size_t kAtOnce = 16;  // views between reports
  const auto render = [&](size_t view) {
    for (const int camera : {0, 1}) {
      Render(cloud, size_m, views.cameras[camera], views.T_camera_world[view][camera],
             &images_[view][camera]);
    }
  };
  ForEachWatched(images_.size(), progress, render, kAtOnce);
}

void SightDepths::Render(const std::vector<DensePoint>& cloud, double size_m, const Camera& camera,
                         const RigidTransform& T_camera_world, DepthImage* image) const {
  image->assign(static_cast<size_t>(columns_) * rows_, std::numeric_limits<float>::infinity());
  const Eigen::Matrix3d R = T_camera_world.rotation.toRotationMatrix();
  const Eigen::Vector3d centre_world = -R.transpose() * T_camera_world.translation;
  for (const DensePoint& point : cloud) {
    const Eigen::Vector3d ray = point.p_world - centre_world;
    if (ray.dot(point.normal_world) > 0) continue;  // its back
    const Eigen::Vector3d p = R * ray;
    if (p.z() < kMinDepth_m || p.z() > kMaxDepth_m) continue;
    const Eigen::Vector2d px = PixelFromPlane(camera, Eigen::Vector2d(p.hnormalized()));
    const double half_px = 0.5 * camera.fx_px * size_m / p.z();
    const auto cell = [](double at_px) { return static_cast<int>(std::floor(at_px / kCell_px)); };
    // A cell is hidden where its middle is.
    const int left = std::max(0, cell(px.x() - half_px + 0.5 * kCell_px));
    const int right = std::min(columns_ - 1, cell(px.x() + half_px - 0.5 * kCell_px));
    const int top = std::max(0, cell(px.y() - half_px + 0.5 * kCell_px));
    const int bottom = std::min(rows_ - 1, cell(px.y() + half_px - 0.5 * kCell_px));
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        float& depth_m = (*image)[row * columns_ + column];
        depth_m = std::min(depth_m, static_cast<float>(p.z()));
      }
    }
  }
}

bool SightDepths::Hides(int view, int camera, const Eigen::Vector2d& px, double depth_m) const {
  if (images_.empty() || images_[view][camera].empty()) return false;
  const int column = static_cast<int>(px.x()) / kCell_px, row = static_cast<int>(px.y()) / kCell_px;
  if (px.x() < 0 || px.y() < 0 || column >= columns_ || row >= rows_) return false;
  const double surface_m = images_[view][camera][row * columns_ + column];
  return surface_m < depth_m - std::max(kClearance_m, kClearanceShare * depth_m);
}

// Inverse depth is linear over the image of a plane. A piece that covers the middle of a cell has
// its own middle up to half its size from there, and the place is up to half a cell from there.
bool SightDepths::HidesSurface(int view, int camera, const Camera& model,
                               const Eigen::Vector3d& p_camera,
                               const Eigen::Vector3d& normal_camera) const {
  const double z_m = p_camera.z();
  const double reach = 0.5 * kCell_px / model.fx_px + 0.5 * size_m_ / z_m;  // at depth 1
  const double from_plane_m = std::max(std::abs(normal_camera.dot(p_camera)), 1e-6);
  const double slope = normal_camera.head<2>().cwiseAbs().sum() / from_plane_m;
  return Hides(view, camera, PixelFromPlane(model, Eigen::Vector2d(p_camera.hnormalized())),
               1 / (1 / z_m + slope * reach));
}

}  // namespace slcmap
