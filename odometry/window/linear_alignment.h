// The closed-form start of visual-inertial estimation in motion, and the gyroscope's bias as images
// alone tell it, before anything else is known.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

// The bias in rad/s with which the rotations of the gyroscope fit the images (the left ones, or of
// two cameras that look apart both): between two
// frames the rays a and R b of every point and the direction of travel t lie in a plane, wherever
// the point is: t . (a x R b) = 0 (Kneip and Lynen, "Direct optimization of frame-to-frame
// rotation", ICCV 2013; over several pairs with one bias: He et al., "A rotation-translation-
// decoupled solution for robust and efficient visual-inertial initialization", CVPR 2023). Each
// pair of frames, `apart_s` or more from each other, has its own t, which is eliminated; the
// distances of points that do not fit weigh less. Needs neither scale nor accelerometer. Nothing
// where there are too few points.
std::optional<Eigen::Vector3d> GyroBiasFromImages(
    const std::vector<std::unique_ptr<FrameState>>& frames, const StereoGeometry& geometry,
    const ImuNoise& noise, double apart_s);

// The state of one frame in the body frame of the first one.
struct LinearState {
  RigidTransform T_first_imu;
  Eigen::Vector3d velocity_first_m_s = Eigen::Vector3d::Zero();
};

struct LinearAlignment {
  std::vector<LinearState> states;                               // one a frame
  Eigen::Vector3d gravity_first_m_s2 = Eigen::Vector3d::Zero();  // as the accelerometer feels it
  double free_gravity_m_s2 = 0;  // its size before it was constrained: far from 9.81 is a bad sign
  int points = 0;
};

// Positions, velocities and gravity of frames whose relative rotations the gyroscope gives. Every
// observation of a point is linear in the point, the first velocity and gravity (Dong-Si and
// Mourikis, "Estimator initialization in vision-aided inertial navigation with unknown camera-IMU
// calibration", IROS 2012); the points are eliminated, gravity is then constrained to its known
// size: `felt_gravity_m_s2`, which differs from 9.81 by the accelerometer's scale; the states are
// free of that scale. Observations are weighted by the point's inverse depth, found in a first
// pass. Works with one camera as with two. Readings are corrected for the bias
// and the errors. Nothing where the system is degenerate.
std::optional<LinearAlignment> AlignLinearly(const std::vector<std::unique_ptr<FrameState>>& frames,
                                             const StereoGeometry& geometry, const ImuNoise& noise,
                                             const Eigen::Vector3d& gyro_bias_rad_s,
                                             const ImuErrors& errors = ImuErrors::Zero(),
                                             double felt_gravity_m_s2 = kGravity_m_s2);

}  // namespace slcmap::odometry
