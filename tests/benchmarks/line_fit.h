// Lines in space from segments seen at known poses, for benchmarks: apart from what is measured.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "data/core/camera.h"
#include "data/core/rigid_transform.h"
#include "odometry/frontend/line_segment.h"

namespace slcmap {

struct Segment3d {
  Eigen::Vector3d a, b;  // in world
};

// One camera's observation of a line, in pixels of the rectified image.
struct View {
  RigidTransform T_world_camera;
  LineSegment px;
};

// A camera without distortion.
class Projector {
 public:
  explicit Projector(const Camera& camera) : camera_(camera) {}

  // In the camera, at z = 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& px) const;

  // The visible part of a segment in space.
  std::optional<LineSegment> Project(const RigidTransform& T_camera_world,
                                     const Segment3d& s) const;

 private:
  Eigen::Vector2d Pixel(const Eigen::Vector3d& p) const;
  std::optional<LineSegment> Clip(const LineSegment& s) const;

  Camera camera_;
};

// The line in space that the observations agree on, between the feet of the first observation's
// ends.
class LineFitter {
 public:
  explicit LineFitter(const Camera& camera) : projector_(camera), focal_px_(camera.fx_px) {}

  // Nothing where the planes of observation are too much alike.
  std::optional<Segment3d> Fit(const std::vector<View>& views) const;

  // Distances of an observation's ends from the line's image, signed.
  std::array<double, 2> Errors_px(const Segment3d& line, const View& view) const;

  // The point of the line nearest to the ray of a pixel.
  Eigen::Vector3d Foot(const Segment3d& line, const View& view, const Eigen::Vector2d& px) const;

 private:
  Eigen::Vector3d PlaneNormal(const View& view) const;
  std::optional<Segment3d> Intersect(const View& a, const View& b) const;
  std::optional<Segment3d> Intersect(const std::vector<View>& views) const;

  Projector projector_;
  double focal_px_;
};

}  // namespace slcmap
