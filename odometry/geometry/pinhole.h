// Pixels of a rectified camera, which is a pinhole, and points on its plane z = 1; how places in
// rectified images move with the cameras behind them; corrected right images.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "data/core/camera.h"
#include "data/core/types.h"

namespace slcmap::inline odometry {

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

// How a camera differs from the one that was given: by which share its focal lengths are longer,
// and its principal point, in px of the image as it was recorded.
struct LensCorrection {
  double focal_length = 0;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
};

// How a place on the plane z = 1 of a rectified camera moves with the given image's pixel there,
// 1 / px. Zero where the camera has no image of it.
Eigen::Matrix2d PlaneByPixel(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
                             const Eigen::Vector2d& measured);

// A camera whose focal lengths are longer by the share s than those it is rectified with, and whose
// principal point is off by d, has the direction that was measured at m, on the plane z = 1 of the
// rectified frame, at
//
//   m - s / (1 + s) g(m) - H(m) d
//
// For an ideal pinhole that looks along z this is (m - d / f) / (1 + s), to first order, with
// g(m) = m. A lens that distorts has larger shifts towards the border (by 20 % and more; fisheye by
// half), and one whose axis is not that of the rectified frame has them about its own axis: between
// two cameras that converge by 0.8 degrees, 0.3 % are 0.02 px of disparity.
class LensShift {
 public:
  LensShift() = default;  // of an ideal pinhole whose principal point is where it was given
  // From a camera as it was given, and the rectified one's orientation and image.
  LensShift(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
            const Camera& rectified);

  Eigen::Vector2d ByFocalLength(const Eigen::Vector2d& measured) const;  // g
  Eigen::Matrix2d GradientAt(const Eigen::Vector2d& measured) const;     // of g
  Eigen::Matrix2d ByCentre(const Eigen::Vector2d& measured) const;       // H

 private:
  struct Node {
    Eigen::Vector2d by_focal_length;
    Eigen::Matrix2d by_centre;
  };
  // Four nodes, by the first of them, and where between them, from 0 to 1.
  struct Cell {
    const Node* first;
    double x, y;
  };
  Cell CellAt(const Eigen::Vector2d& measured) const;
  // Between the nodes around a place.
  template <typename Field>
  Field Interpolated(Field Node::*field, const Eigen::Vector2d& measured) const {
    const auto [node, x, y] = CellAt(measured);
    const Node* below = node + columns_;
    return (1 - y) * ((1 - x) * node[0].*field + x * node[1].*field) +
           y * ((1 - x) * below[0].*field + x * below[1].*field);
  }

  // The shifts at the nodes of a grid over the rectified image, row by row; interpolated in
  // between.
  std::vector<Node> nodes_;
  Eigen::Vector2d first_ = Eigen::Vector2d::Zero(), per_step_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
};

// Of all cameras of a rig, by the rectified ones.
std::vector<LensShift> ComputeLensShifts(const Rig& given, const Rig& rectified);

// Right images that are rectified with what was found of the right camera, while all measurements
// are told as the given calibration has them.

// What was found of the right camera: turned by Exp(rotation_rad) in its rectified frame, with its
// principal point off by centre_px of the image as it was recorded.
struct RightCorrection {
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
};

class RightRectification {
 public:
  RightRectification() = default;
  // `rectified` is the right rectified camera, and `lens` how places in it move with the given one.
  RightRectification(const Camera& rectified, const LensShift& lens)
      : camera_(rectified), lens_(lens) {}

  // From now on pixels are of images that were rectified so.
  void Set(const RightCorrection& correction) { correction_ = correction; }

  // A pixel on the plane z = 1 of the right rectified camera as it was given.
  Eigen::Vector2d GivenPlane(const Eigen::Vector2d& px) const;

  // How far the rows of images are off, were the right camera as `is`: at their middle or corners,
  // where that is most.
  double RowsOff_px(const RightCorrection& is) const;

 private:
  Camera camera_;
  LensShift lens_;
  RightCorrection correction_;
};

}  // namespace slcmap::odometry
