// Pixels of a rectified camera, which is a pinhole, and points on its plane z = 1.
#pragma once

#include <Eigen/Core>

#include "data/camera.h"
#include "data/types.h"

namespace slcmap {

inline Eigen::Vector2d PlaneFromPixel(const Camera& camera, const Eigen::Vector2d& px) {
  return {(px.x() - camera.cx_px) / camera.fx_px, (px.y() - camera.cy_px) / camera.fy_px};
}

inline Eigen::Vector2d PixelFromPlane(const Camera& camera, const Eigen::Vector2d& on_plane) {
  return {camera.fx_px * on_plane.x() + camera.cx_px, camera.fy_px * on_plane.y() + camera.cy_px};
}

inline LineSegment PlaneFromPixel(const Camera& camera, const LineSegment& segment_px) {
  return {PlaneFromPixel(camera, segment_px.start), PlaneFromPixel(camera, segment_px.end)};
}

inline LineSegment PixelFromPlane(const Camera& camera, const LineSegment& on_plane) {
  return {PixelFromPlane(camera, on_plane.start), PixelFromPlane(camera, on_plane.end)};
}

}  // namespace slcmap
