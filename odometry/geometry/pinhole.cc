#include "odometry/geometry/pinhole.h"

#include <algorithm>
#include <cmath>

#include "data/calibration/calibration.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNodeDistance_px = 24;

// g by a small change of the focal lengths; of the ideal pinhole where the camera has no image.
Vector2d ShiftAt(const Vector2d& measured, const Camera& camera, const Eigen::Matrix3d& R) {
  constexpr double kLonger = 1e-3;
  const auto pixel = camera.Project(R * measured.homogeneous());
  if (!pixel) return measured;
  Camera longer = camera;
  longer.fx_px *= 1 + kLonger;
  longer.fy_px *= 1 + kLonger;
  const auto ray = longer.Unproject(*pixel);
  if (!ray) return measured;
  const Vector3d in_rectified = R.transpose() * *ray;
  if (in_rectified.z() <= 0) return measured;
  return (measured - in_rectified.hnormalized()) * (1 + kLonger) / kLonger;
}

}  // namespace

Eigen::Matrix2d PlaneByPixel(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
                             const Eigen::Vector2d& measured) {
  constexpr double kStep_px = 0.5;
  const auto pixel = camera.Project(R_camera_rectified * measured.homogeneous());
  if (!pixel) return Eigen::Matrix2d::Zero();
  const auto on_plane = [&](const Eigen::Vector2d& at) -> std::optional<Eigen::Vector2d> {
    const auto ray = camera.Unproject(at);
    if (!ray) return std::nullopt;
    const Eigen::Vector3d in_rectified = R_camera_rectified.conjugate() * *ray;
    if (in_rectified.z() <= 0) return std::nullopt;
    return in_rectified.hnormalized();
  };
  Eigen::Matrix2d by_pixel;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kStep_px * Eigen::Vector2d::Unit(k);
    const auto after = on_plane(*pixel + step), before = on_plane(*pixel - step);
    if (!after || !before) return Eigen::Matrix2d::Zero();
    by_pixel.col(k) = (*after - *before) / (2 * kStep_px);
  }
  return by_pixel;
}

LensShift::LensShift(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
                     const Camera& rectified) {
  const Eigen::Matrix3d R = R_camera_rectified.toRotationMatrix();
  columns_ = 2 + static_cast<int>(rectified.width_px / kNodeDistance_px);
  rows_ = 2 + static_cast<int>(rectified.height_px / kNodeDistance_px);
  first_ = PlaneFromPixel(rectified, Vector2d(0, 0));
  const Vector2d step =
      PlaneFromPixel(rectified, Vector2d(kNodeDistance_px, kNodeDistance_px)) - first_;
  per_step_ = step.cwiseInverse();
  nodes_.reserve(static_cast<size_t>(columns_) * rows_);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Vector2d at = first_ + step.cwiseProduct(Vector2d(column, row));
      nodes_.push_back({ShiftAt(at, camera, R), PlaneByPixel(camera, R_camera_rectified, at)});
    }
  }
}

LensShift::Cell LensShift::CellAt(const Vector2d& measured) const {
  const Vector2d at = (measured - first_).cwiseProduct(per_step_);
  const int column = std::clamp(static_cast<int>(std::floor(at.x())), 0, columns_ - 2);
  const int row = std::clamp(static_cast<int>(std::floor(at.y())), 0, rows_ - 2);
  return {nodes_.data() + static_cast<size_t>(row) * columns_ + column, at.x() - column,
          at.y() - row};
}

Vector2d LensShift::ByFocalLength(const Vector2d& measured) const {
  return nodes_.empty() ? measured : Interpolated(&Node::by_focal_length, measured);
}

Eigen::Matrix2d LensShift::GradientAt(const Vector2d& measured) const {
  if (nodes_.empty()) return Eigen::Matrix2d::Identity();
  const auto [node, x, y] = CellAt(measured);
  const Node* below = node + columns_;
  Eigen::Matrix2d gradient;
  gradient.col(0) = (1 - y) * (node[1].by_focal_length - node[0].by_focal_length) +
                    y * (below[1].by_focal_length - below[0].by_focal_length);
  gradient.col(1) = (1 - x) * (below[0].by_focal_length - node[0].by_focal_length) +
                    x * (below[1].by_focal_length - node[1].by_focal_length);
  return gradient * per_step_.asDiagonal();
}

Eigen::Matrix2d LensShift::ByCentre(const Vector2d& measured) const {
  if (nodes_.empty()) return Eigen::Matrix2d::Zero();
  return Interpolated(&Node::by_centre, measured);
}

std::vector<LensShift> ComputeLensShifts(const Rig& given, const Rig& rectified) {
  std::vector<LensShift> shifts(given.cameras.size());
  for (size_t i = 0; i < static_cast<size_t>(CameraCount(given)); ++i) {
    shifts[i] =
        LensShift(given.cameras[i],
                  given.T_imu_camera[i].rotation.conjugate() * rectified.T_imu_camera[i].rotation,
                  rectified.cameras[i]);
  }
  return shifts;
}

Vector2d RightRectification::GivenPlane(const Vector2d& px) const {
  const Vector2d turned_back =
      (ExpRotation(-correction_.rotation_rad) * PlaneFromPixel(camera_, px).homogeneous())
          .hnormalized();
  // Of m - H(m) d, as the header has it.
  const Vector2d near = turned_back + lens_.ByCentre(turned_back) * correction_.centre_px;
  return turned_back + lens_.ByCentre(near) * correction_.centre_px;
}

double RightRectification::RowsOff_px(const RightCorrection& is) const {
  const Eigen::Quaterniond R_rectified_is = ExpRotation(is.rotation_rad);
  double off_px = 0;
  for (const auto& [x, y] : {std::pair{0.5, 0.5}, {0.1, 0.1}, {0.9, 0.1}, {0.1, 0.9}, {0.9, 0.9}}) {
    const Vector2d px(x * camera_.width_px, y * camera_.height_px);
    const Vector2d given = GivenPlane(px);
    const Vector2d through_lens = given - lens_.ByCentre(given) * is.centre_px;
    const Vector2d turned = (R_rectified_is * through_lens.homogeneous()).hnormalized();
    off_px = std::max(off_px, std::abs(PixelFromPlane(camera_, turned).y() - px.y()));
  }
  return off_px;
}

}  // namespace slcmap::odometry
