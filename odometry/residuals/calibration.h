// What the window estimates of the rig beside its motion: where the IMU is against the cameras, and
// the cameras against each other, as corrections of the calibration that was given.
#pragma once

#include <array>

#include "odometry/residuals/pose_manifold.h"

namespace slcmap {

// The body is the left camera's rigid frame, placed where the given calibration has the IMU: poses
// of the window are the body's at the very moment of exposure. An IMU calibration block is
//
//   (phi, tau, delta): rotation vector in rad, lever in m, time in s
//
// with the IMU's true place in the body T_body_imu = (Exp(phi), tau), and exposure later by delta,
// on the IMU's clock, than the given time offset has it. Perturbed by addition.
inline constexpr int kImuCalibrationSize = 7;
enum ImuCalibrationRow { kRowImuRotation = 0, kRowLever = 3, kRowTimeOffset = 6 };

// A camera calibration block is
//
//   (psi, s): rotation vector in rad, and the share by which focal lengths are longer than given
//
// with the right camera's true place T_imu_right (Exp(psi), 0), and a point p of a camera's true
// frame seen where p.xy / p.z = m - s / (1 + s) g(m) holds for the measurement m on the plane z = 1
// (see geometry/focal_shift.h; of an ideal pinhole m = (1 + s) p.xy / p.z). Perturbed by addition.
inline constexpr int kCameraCalibrationSize = 4;
enum CameraCalibrationRow { kRowRightRotation = 0, kRowFocalLength = 3 };

using ImuCalibrationBlock = std::array<double, kImuCalibrationSize>;
using CameraCalibrationBlock = std::array<double, kCameraCalibrationSize>;

struct CalibrationState {
  ImuCalibrationBlock imu{};
  CameraCalibrationBlock cameras{};
};

// Both blocks as one vector: the IMU's, then that of the cameras.
inline constexpr int kCalibrationSize = kImuCalibrationSize + kCameraCalibrationSize;
using CalibrationVector = Eigen::Matrix<double, kCalibrationSize, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationSize, kCalibrationSize>;

// The turn Exp(psi) of the right camera of a camera calibration block.
inline Eigen::Quaterniond RightRotation(const double* block) {
  return ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowRightRotation));
}

// Of an IMU calibration block.
inline RigidTransform BodyFromImu(const double* block) {
  return {ExpRotation(Eigen::Map<const Eigen::Vector3d>(block + kRowImuRotation)),
          Eigen::Map<const Eigen::Vector3d>(block + kRowLever)};
}

}  // namespace slcmap
