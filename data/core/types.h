// What several folders speak of: what a stereo camera and an IMU deliver, their calibration, the
// axes of a building, and what was observed of points and lines.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/camera.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline data {

inline constexpr double kGravity_m_s2 = 9.81;  // along -z of the world

// One IMU measurement, in the IMU frame.
struct ImuSample {
  int64_t stamp_ns = 0;
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_m_s2 = Eigen::Vector3d::Zero();  // (0, 0, +9.81) lying still
};

// A stereo pair: 8 bit, one channel. The right image is empty where there is only one camera. The
// stamp is the middle of the exposure, on the camera's clock.
struct StereoImage {
  int64_t stamp_ns = 0;
  cv::Mat left;
  cv::Mat right;
};

// Noise of an IMU as continuous densities, in the units of the ASL and Kalibr files.
struct ImuNoise {
  double gyro_noise_rad_s_sqrthz = 1.7e-4;
  double gyro_walk_rad_s2_sqrthz = 2.0e-5;
  double accel_noise_m_s2_sqrthz = 2.0e-3;
  double accel_walk_m_s3_sqrthz = 3.0e-3;
  double rate_hz = 200;
};

// Linear errors of an IMU, as calibrated: what an ideal one in the IMU frame would read is
// correction * what it reads, of scale, axes that are not at right angles, and a turn between them.
struct ImuCorrection {
  Eigen::Matrix3d accel = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Identity();
};

// Fifteen numbers that are 0 of an IMU that reads as was given. An ideal IMU would read A a and G w
// where it reads a (force) and w (turn rate):
//
//       | 1 + s_x                    |        | 1 + g_x    m_xy     m_xz   |
//   A = |  m_yx    1 + s_y           |    G = |  m_yx     1 + g_y   m_yz   |
//       |  m_zx     m_zy    1 + s_z  |        |  m_zx      m_zy    1 + g_z |
//
// so that the IMU's frame has the accelerometer's x axis, and its y axis in the plane of x and y,
// as Kalibr's scale-misalignment model has it; the gyroscope may be turned in it.
inline constexpr int kImuErrorsSize = 15;
enum ImuErrorRow {
  kErrorAccelScale = 0,  // s_x, s_y, s_z
  kErrorAccelAxes = 3,   // m_yx, m_zx, m_zy
  kErrorGyroScale = 6,   // g_x, g_y, g_z
  kErrorGyroAxes = 9     // m_xy, m_xz, m_yx, m_yz, m_zx, m_zy
};
using ImuErrors = Eigen::Matrix<double, kImuErrorsSize, 1>;

// A calibrated rig. Index 0 is the left camera, or the first one of two that look apart.
struct Rig {
  std::array<Camera, 2> cameras;
  std::array<RigidTransform, 2> T_imu_camera;
  ImuNoise imu_noise;
  ImuCorrection imu_correction;
  // 8 bit, of the camera's size: 0 where an image shows what moves with the rig instead of the
  // building. Empty: nowhere.
  std::array<cv::Mat, 2> masks;
  double camera_time_offset_s = 0;  // stamp on the IMU's clock = camera stamp + this
  // The right image is taken so much after the left one. Cameras that are triggered together have
  // none.
  double right_time_offset_s = 0;
  // By how much the last row of a camera with a rolling shutter is exposed after the first;
  // negative where the last comes first, and 0 of a global shutter. Stamps are those of the middle
  // row.
  std::array<double, 2> readout_s{};
};

// A rig of one camera has no width in its second.
inline bool HasTwoCameras(const Rig& rig) { return rig.cameras[1].width_px > 0; }

// Whether two cameras look in directions more than 60 degrees from each other: as a pair of little
// use, they are followed one by one.
inline bool LookApart(const RigidTransform& T_imu_first, const RigidTransform& T_imu_second) {
  constexpr double kLeastCosine = 0.5;
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return (T_imu_first.rotation * z).dot(T_imu_second.rotation * z) < kLeastCosine;
}
inline bool LooksApart(const Rig& rig) {
  return HasTwoCameras(rig) && LookApart(rig.T_imu_camera[0], rig.T_imu_camera[1]);
}

// Whether two cameras see the same.
inline bool IsStereo(const Rig& rig) { return HasTwoCameras(rig) && !LooksApart(rig); }

// Whether all rows of both images are exposed at the stamp.
inline bool IsTakenAtOnce(const Rig& rig) {
  return rig.right_time_offset_s == 0 && rig.readout_s[0] == 0 && rig.readout_s[1] == 0;
}

// How long after the stamp of its pair a row of a camera's image, as it was recorded, is exposed.
inline double RowTime_s(const Rig& rig, int camera, double row_px) {
  const double share = (row_px + 0.5) / rig.cameras[camera].height_px - 0.5;  // of the readout
  return (camera == 1 ? rig.right_time_offset_s : 0) + rig.readout_s[camera] * share;
}

// What is made of a rotation whose determinant is -1: a MirroredFault; or the rotation that all its
// numbers negated are, for the check to tell which axes are wrong.
enum class Mirrored { kRefused, kNegated };

// A value of the calibration in whose place the check of a recording found another, to start
// odometry from.
struct CheckCorrection {
  std::string name;            // one of those below
  std::vector<double> values;  // as the name says
  std::string words;
};

// {camera_time_offset_s} of the rig.
inline constexpr const char* kTimeOffsetCorrection = "camera_time_offset_s";
// {x, y, z}: the right camera's rotation is that of the calibration times Exp(x, y, z).
inline constexpr const char* kRightTurnCorrection = "right_camera_turn_rad";
// {left, right}: focal lengths of the cameras are those of the calibration times 1 + these. Only
// their difference is seen; either camera may be the one that is off, so half of it is given to
// each.
inline constexpr const char* kFocalCorrection = "focal_lengths";

// What a line runs along: an axis of a Manhattan world, nothing that is known, or a slope that it
// shares with others. Files hold these numbers.
enum class LineAxis { kX = 0, kY = 1, kVertical = 2, kNone = 3, kSloped = 4 };

// A straight segment, in pixels of a rectified image or on the plane z = 1 of a camera (the name of
// what holds it says which). Which end is the start means nothing.
struct LineSegment {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  Eigen::Vector2d end = Eigen::Vector2d::Zero();

  Eigen::Vector2d Midpoint() const { return 0.5 * (start + end); }
  double Length() const { return (end - start).norm(); }
};

// A tracked point in one stereo pair, in pixels of the rectified cameras. right_px is only known
// where the right image was looked at.
struct PointObservation {
  int64_t id = 0;
  Eigen::Vector2d left_px = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right_px;
  int camera = 0;  // whose left_px it is: 1 where two look apart, and the second one saw it
};

// A tracked line in one stereo pair, in pixels of the rectified cameras. Ends along the line are
// not repeatable: they say how far it was seen, not where it stops.
struct LineObservation {
  int64_t id = 0;
  LineSegment left_px;
  std::optional<LineSegment> right_px;
  int camera = 0;  // as of a point
};

inline double ToSeconds(int64_t ns) { return static_cast<double>(ns) * 1e-9; }
inline int64_t ToNanoseconds(double s) {
  return static_cast<int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5));
}

// What no IMU on a building's mapper measures.

inline constexpr double kMaxGyro_rad_s = 100, kMaxAccel_m_s2 = 1000;

// False where a value is not finite or beyond the limits.
inline bool IsPlausible(const ImuSample& sample) {
  return sample.angular_velocity_rad_s.norm() < kMaxGyro_rad_s &&
         sample.specific_force_m_s2.norm() < kMaxAccel_m_s2;
}

}  // namespace slcmap::data
