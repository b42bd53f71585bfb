#include "odometry/geometry/focal_shift.h"

#include <algorithm>
#include <cmath>

#include "data/calibration.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
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

FocalShift::FocalShift(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
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
      nodes_.push_back(ShiftAt(first_ + step.cwiseProduct(Vector2d(column, row)), camera, R));
    }
  }
}

FocalShift::Cell FocalShift::CellAt(const Vector2d& measured) const {
  const Vector2d at = (measured - first_).cwiseProduct(per_step_);
  const int column = std::clamp(static_cast<int>(std::floor(at.x())), 0, columns_ - 2);
  const int row = std::clamp(static_cast<int>(std::floor(at.y())), 0, rows_ - 2);
  return {nodes_.data() + static_cast<size_t>(row) * columns_ + column, at.x() - column,
          at.y() - row};
}

Vector2d FocalShift::At(const Vector2d& measured) const {
  if (nodes_.empty()) return measured;
  const auto [node, x, y] = CellAt(measured);
  return (1 - y) * ((1 - x) * node[0] + x * node[1]) +
         y * ((1 - x) * node[columns_] + x * node[columns_ + 1]);
}

Eigen::Matrix2d FocalShift::GradientAt(const Vector2d& measured) const {
  if (nodes_.empty()) return Eigen::Matrix2d::Identity();
  const auto [node, x, y] = CellAt(measured);
  Eigen::Matrix2d gradient;
  gradient.col(0) = (1 - y) * (node[1] - node[0]) + y * (node[columns_ + 1] - node[columns_]);
  gradient.col(1) = (1 - x) * (node[columns_] - node[0]) + x * (node[columns_ + 1] - node[1]);
  return gradient * per_step_.asDiagonal();
}

std::array<FocalShift, 2> FocalShiftsOf(const Rig& given, const Rig& rectified) {
  std::array<FocalShift, 2> shifts;
  for (int i = 0; i < (IsStereo(given) ? 2 : 1); ++i) {
    shifts[i] =
        FocalShift(given.cameras[i],
                   given.T_imu_camera[i].rotation.conjugate() * rectified.T_imu_camera[i].rotation,
                   rectified.cameras[i]);
  }
  return shifts;
}

}  // namespace slcmap
