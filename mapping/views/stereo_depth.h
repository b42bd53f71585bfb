// The depth of a view at the nodes of a grid over its rectified left image, first by semi-global
// matching of the pair, and its slopes.
#pragma once

#include <Eigen/Core>
#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/core/camera.h"
#include "data/core/types.h"
#include "mapping/views/options.h"

namespace slcmap::inline mapping {

inline constexpr double kDepthMaxGrazing_deg = 75;  // between a surface's normal and the ray to it

// Inverse depth, 1/z in 1/m, is linear over the image of a plane, and so are disparities: the
// surface around a node is given by its value there and its slopes in 1/m per pixel.
struct DepthNode {
  float inverse_depth = 0;  // 0: not known
  float slope_x = 0, slope_y = 0;
  float sigma = 0;  // standard deviation of inverse_depth
  uint8_t grey = 0;

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
inline Eigen::Vector3d MakePlane(const DepthNode& node, const Camera& camera,
                                 const Eigen::Vector3d& ray) {
  const double x = node.slope_x * camera.fx_px, y = node.slope_y * camera.fy_px;
  return {x, y, node.inverse_depth - x * ray.x() - y * ray.y()};
}

// The unit normal of the surface at a node, towards the camera.
inline Eigen::Vector3d ComputeNormal(const DepthNode& node, const Camera& camera,
                                     const Eigen::Vector3d& ray) {
  return -MakePlane(node, camera, ray).normalized();
}

// The cosine of the angle between a surface's normal and the ray to it.
inline double CosineOfView(const DepthNode& node, const Camera& camera,
                           const Eigen::Vector3d& ray) {
  return -ComputeNormal(node, camera, ray).dot(ray) / ray.norm();
}

// The slopes of inverse depth (or disparity) around a place, by least squares.

// Fits value = c + a x + b y to weighted samples.
class SlopeFit {
 public:
  void Add(double x, double y, double value, double weight = 1) {
    const Eigen::Vector3d row(1, x, y);
    normal_ += weight * row * row.transpose();
    right_ += weight * value * row;
    ++count_;
  }
  int count() const { return count_; }

  // (c, a, b); nothing where the samples lie on a line.
  std::optional<Eigen::Vector3d> Solve() const {
    const Eigen::LDLT<Eigen::Matrix3d> factors(normal_);
    const Eigen::Vector3d pivots = factors.vectorD();
    if (count_ < 3 || pivots.minCoeff() <= 1e-9 * pivots.maxCoeff()) return std::nullopt;
    return factors.solve(right_);
  }

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

// Between the cameras of a pair of a rig.
double Baseline_m(const Rig& rig, int left_camera = 0);

// Matches the pair at half size (H. Hirschmueller, "Stereo processing by semiglobal matching and
// mutual information", PAMI 2008, as OpenCV has it), checks left against right, and fits a plane of
// disparities around each node of the grid. Nodes at depth edges, on surfaces seen at a grazing
// angle, outside of the mask (255 where there are pixels) and beyond the range of depth stay
// unknown. Sigma is that of matching: about a third of a pixel.
DepthGrid StereoDepth(const StereoImage& pair, const cv::Mat& mask, const Rig& rig,
                      const DenseOptions& options, int left_camera = 0);

}  // namespace slcmap::mapping
