// The depth of a view at the nodes of a grid over its rectified left image.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "data/camera.h"

namespace slcmap {

// Inverse depth, 1/z in 1/m, is linear over the image of a plane, and so are disparities: the
// surface around a node is given by its value there and its slopes in 1/m per pixel.
struct DepthNode {
  float inverse_depth = 0;  // 0: not known
  float slope_x = 0, slope_y = 0;
  float sigma = 0;  // standard deviation of inverse_depth
  uint8_t grey = 0;
  bool is_filled = false;  // from a plane, not from this pixel's own match

  bool is_known() const { return inverse_depth > 0; }
  double depth_m() const { return 1 / inverse_depth; }
  // Of the depth, to first order.
  double depth_sigma_m() const { return sigma / (inverse_depth * inverse_depth); }
};

struct DepthGrid {
  int columns = 0, rows = 0;
  int step_px = 1;
  std::vector<DepthNode> nodes;  // row by row

  DepthGrid() = default;
  DepthGrid(const Camera& camera, int step)
      : columns(camera.width_px / step),
        rows(camera.height_px / step),
        step_px(step),
        nodes(static_cast<std::size_t>(columns) * rows) {}

  DepthNode& At(int column, int row) { return nodes[row * columns + column]; }
  const DepthNode& At(int column, int row) const { return nodes[row * columns + column]; }
  bool Contains(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows;
  }
  int ColumnPixel(int column) const { return column * step_px + step_px / 2; }
  int RowPixel(int row) const { return row * step_px + step_px / 2; }

  // The node next to a pixel, where there is one that is known; else nullptr.
  const DepthNode* KnownNear(const Eigen::Vector2d& pixel_px, Eigen::Vector2d* offset_px) const {
    const int column = static_cast<int>(std::floor((pixel_px.x() + 0.5) / step_px));
    const int row = static_cast<int>(std::floor((pixel_px.y() + 0.5) / step_px));
    if (!Contains(column, row) || !At(column, row).is_known()) return nullptr;
    *offset_px = pixel_px - Eigen::Vector2d(ColumnPixel(column), RowPixel(row));
    return &At(column, row);
  }
};

// The ray of a pixel of a rectified camera, at depth 1.
inline Eigen::Vector3d PinholeRay(const Camera& camera, double u_px, double v_px) {
  return {(u_px - camera.cx_px) / camera.fx_px, (v_px - camera.cy_px) / camera.fy_px, 1};
}

// The plane n.p = 1 (camera frame) that a node at a pixel is on.
inline Eigen::Vector3d PlaneOf(const DepthNode& node, const Camera& camera,
                               const Eigen::Vector3d& ray) {
  const double x = node.slope_x * camera.fx_px, y = node.slope_y * camera.fy_px;
  return {x, y, node.inverse_depth - x * ray.x() - y * ray.y()};
}

// The unit normal of the surface at a node, towards the camera.
inline Eigen::Vector3d NormalOf(const DepthNode& node, const Camera& camera,
                                const Eigen::Vector3d& ray) {
  return -PlaneOf(node, camera, ray).normalized();
}

// The cosine of the angle between a surface's normal and the ray to it.
inline double CosineOfView(const DepthNode& node, const Camera& camera,
                           const Eigen::Vector3d& ray) {
  return -NormalOf(node, camera, ray).dot(ray) / ray.norm();
}

}  // namespace slcmap
