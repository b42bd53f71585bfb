// Linear errors of an IMU as the odometry estimates them: scale and axes of both sensors.
#pragma once

#include <Eigen/Core>
#include <array>

#include "data/types.h"

namespace slcmap {

// Fifteen numbers that are 0 of an IMU that reads as was given. An ideal IMU would read A a and G w
// where it reads a (force) and w (turn rate):
//
//       | 1 + s_x                    |        | 1 + g_x    m_xy     m_xz   |
//   A = |  m_yx    1 + s_y           |    G = |  m_yx     1 + g_y   m_yz   |
//       |  m_zx     m_zy    1 + s_z  |        |  m_zx      m_zy    1 + g_z |
//
// so that the IMU's frame has the accelerometer's x axis, and its y axis in the plane of x and y, as
// Kalibr's scale-misalignment model has it; the gyroscope may be turned in it.
inline constexpr int kImuErrorsSize = 15;
enum ImuErrorRow {
  kErrorAccelScale = 0,  // s_x, s_y, s_z
  kErrorAccelAxes = 3,   // m_yx, m_zx, m_zy
  kErrorGyroScale = 6,   // g_x, g_y, g_z
  kErrorGyroAxes = 9     // m_xy, m_xz, m_yx, m_yz, m_zx, m_zy
};
using ImuErrors = Eigen::Matrix<double, kImuErrorsSize, 1>;

// Where an error stands: in the accelerometer's matrix or in the gyroscope's, row and column.
struct ImuErrorPlace {
  bool is_accel;
  int row, column;
};
inline constexpr std::array<ImuErrorPlace, kImuErrorsSize> kImuErrorPlaces{
    {{true, 0, 0},  {true, 1, 1},  {true, 2, 2},  {true, 1, 0},  {true, 2, 0},
     {true, 2, 1},  {false, 0, 0}, {false, 1, 1}, {false, 2, 2}, {false, 0, 1},
     {false, 0, 2}, {false, 1, 0}, {false, 1, 2}, {false, 2, 0}, {false, 2, 1}}};

inline ImuCorrection CorrectionOf(const ImuErrors& errors) {
  ImuCorrection correction;
  for (int i = 0; i < kImuErrorsSize; ++i) {
    const ImuErrorPlace& place = kImuErrorPlaces[i];
    (place.is_accel ? correction.accel : correction.gyro)(place.row, place.column) += errors[i];
  }
  return correction;
}

}  // namespace slcmap
