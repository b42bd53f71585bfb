#include "mapping/lines/line_in_view.h"

#include <algorithm>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

// Cuts the range of u where a + u b is negative.
void Cut(double a, double b, double* from, double* to) {
  if (b > 0) *from = std::max(*from, -a / b);
  if (b < 0) *to = std::min(*to, -a / b);
  if (b == 0 && a < 0) *to = *from - 1;
}

}  // namespace

// Depth is linear along the line, and inverse depth along its image.
double LineInView::AlongAt(double share) const {
  const double far = share * start_depth_m, near = (1 - share) * end_depth_m;
  return from_m + far / (far + near) * (to_m - from_m);
}

double LineInView::DepthAt(double share) const {
  return 1 / ((1 - share) / start_depth_m + share / end_depth_m);
}

std::optional<LineInView> SeenPart(const PointAndDirection& line, const Stretch& stretch,
                                   const RigidTransform& T_camera_world, const Camera& camera,
                                   const ViewLimits& limits) {
  const Eigen::Vector3d p = T_camera_world * line.point_world;
  const Eigen::Vector3d d = T_camera_world.rotation * line.direction_world;
  double from = stretch.from_m, to = stretch.to_m;
  Cut(p.z() - limits.min_depth_m, d.z(), &from, &to);
  Cut(limits.max_depth_m - p.z(), -d.z(), &from, &to);
  // left <= x / z <= right and so on, with z > 0
  const auto cut_at = [&](const Eigen::Vector3d& normal) {
    Cut(normal.dot(p), normal.dot(d), &from, &to);
  };
  const double right = (camera.width_px - 1 - limits.margin_px - camera.cx_px) / camera.fx_px;
  const double bottom = (camera.height_px - 1 - limits.margin_px - camera.cy_px) / camera.fy_px;
  cut_at({1, 0, (camera.cx_px - limits.margin_px) / camera.fx_px});
  cut_at({-1, 0, right});
  cut_at({0, 1, (camera.cy_px - limits.margin_px) / camera.fy_px});
  cut_at({0, -1, bottom});
  if (!(from < to)) return std::nullopt;
  const Eigen::Vector3d start = p + from * d, end = p + to * d;
  return LineInView{
      {PixelFromPlane(camera, start.hnormalized()), PixelFromPlane(camera, end.hnormalized())},
      from,
      to,
      start.z(),
      end.z()};
}

}  // namespace slcmap
