// Whether the world of poses that were given has up where the accelerometer has it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "data/types.h"
#include "odometry/run.h"

namespace slcmap {

// The mean specific force at the poses, in their world, m/s^2: about (0, 0, 9.8) where they are
// those of the IMU and z is up. Images stamped t were taken at t + camera_time_offset_s of the
// IMU's clock. None where few poses have a sample within 20 ms, or
// samples are no m/s^2.
std::optional<Eigen::Vector3d> MeanForceAt(const std::vector<OnlineState>& states,
                                           const std::vector<ImuSample>& imu,
                                           double camera_time_offset_s);

// What is wrong with it, in words; empty where nothing is.
std::string WhatIsNotUp(const Eigen::Vector3d& mean_force_m_s2);

}  // namespace slcmap
