#include "export/frustum.h"

#include <optional>

namespace slcmap {

std::vector<Eigen::Vector3d> FrustumCorners(const Camera& camera, double depth_m) {
  if (!(camera.fx_px > 0 && camera.fy_px > 0)) return {};
  const double right_px = camera.width_px - 0.5, bottom_px = camera.height_px - 0.5;
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& pixel_px :
       {Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(right_px, -0.5),
        Eigen::Vector2d(right_px, bottom_px), Eigen::Vector2d(-0.5, bottom_px)}) {
    const std::optional<Eigen::Vector3d> ray = camera.Unproject(pixel_px);
    if (!ray || !(ray->z() > 0)) return {};
    corners.push_back(*ray * (depth_m / ray->z()));
  }
  return corners;
}

}  // namespace slcmap
