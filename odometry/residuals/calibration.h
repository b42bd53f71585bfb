// What the window estimates of the rig beside its motion: where the IMU is against the cameras, and
// the cameras against each other, as corrections of the calibration that was given.
#pragma once

#include <array>

#include "odometry/geometry/lens_shift.h"
#include "odometry/imu/imu_errors.h"
#include "odometry/residuals/pose_manifold.h"

namespace slcmap {

// The body is the left camera's rigid frame, placed where the given calibration has the IMU: poses
// of the window are the body's at the very moment of exposure. An IMU calibration block is
//
//   (phi, tau, delta, e): rotation vector in rad, lever in m, time in s, errors (imu/imu_errors.h)
//
// with the IMU's true place in the body T_body_imu = (Exp(phi), tau), and exposure later by delta,
// on the IMU's clock, than the given time offset has it, and the IMU's readings to be corrected for
// e, which comes after what the given calibration says of them. Perturbed by addition.
inline constexpr int kImuCalibrationSize = 7 + kImuErrorsSize;
enum ImuCalibrationRow { kRowImuRotation = 0, kRowLever = 3, kRowTimeOffset = 6, kRowErrors = 7 };

// A camera calibration block is
//
//   (psi, s, d): rotation vector in rad, the share by which focal lengths are longer than given,
//   and by how many px of the image as it was recorded the right camera's principal point is off
//
// with the right camera's true place T_imu_right (Exp(psi), 0), and a point p of a camera's true
// frame seen where p.xy / p.z = m - s / (1 + s) g(m) - H(m) d holds for the measurement m on the
// plane z = 1 (see geometry/lens_shift.h; of an ideal pinhole m = (1 + s) p.xy / p.z + d / f; d is
// 0 in the left camera). Perturbed by addition. Of both principal points in common little is told:
// it looks like a turn of the IMU.
inline constexpr int kCameraCalibrationSize = 6;
enum CameraCalibrationRow { kRowRightRotation = 0, kRowFocalLength = 3, kRowRightCentre = 4 };

using ImuCalibrationBlock = std::array<double, kImuCalibrationSize>;
using CameraCalibrationBlock = std::array<double, kCameraCalibrationSize>;

struct CalibrationState {
  ImuCalibrationBlock imu{};
  CameraCalibrationBlock cameras{};
};

// Both blocks as one vector: the IMU's, then that of the cameras.
inline constexpr int kCameras = kImuCalibrationSize;  // row where the cameras' block starts
inline constexpr int kCalibrationSize = kImuCalibrationSize + kCameraCalibrationSize;
using CalibrationVector = Eigen::Matrix<double, kCalibrationSize, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationSize, kCalibrationSize>;

// The turn Exp(psi) of the right camera of a camera calibration block.
inline Eigen::Quaterniond RightRotation(const double* block) {
  return ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowRightRotation));
}

// What a camera calibration block says of the lens of the left camera (0) or of the right one.
inline LensCorrection LensOf(int camera, const double* block) {
  LensCorrection lens;
  lens.focal_length = block[kRowFocalLength];
  if (camera == 1) lens.centre_px = Eigen::Map<const Eigen::Vector2d>(block + kRowRightCentre);
  return lens;
}

// Of an IMU calibration block.
inline ImuErrors ErrorsOf(const double* block) {
  return Eigen::Map<const ImuErrors>(block + kRowErrors);
}
inline RigidTransform BodyFromImu(const double* block) {
  return {ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowImuRotation)),
          Eigen::Map<const Eigen::Vector3d>(block + kRowLever)};
}

}  // namespace slcmap
