// What several folders speak of: what a stereo camera and an IMU deliver, their calibration, the
// axes of a building, and what was observed of points and lines.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
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

// A stereo pair, or what all cameras of a rig see at a time: 8 bit, one channel. The right image is
// empty where there is only one camera. The stamp is the middle of the exposure, on the camera's
// clock.
struct StereoImage {
  int64_t stamp_ns = 0;
  cv::Mat left;
  cv::Mat right;
  std::vector<cv::Mat> others = {};  // of the third camera on; empty images where there are none

  const cv::Mat& of(int camera) const {
    return camera == 0 ? left : camera == 1 ? right : others.at(static_cast<size_t>(camera) - 2);
  }
  int cameras() const { return 2 + static_cast<int>(others.size()); }
};

// Give the images of the second camera on, empty ones where the pixels are damaged; null of a
// camera that has none.
using DeferredImages = std::vector<std::function<cv::Mat()>>;

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

// A calibrated rig of any number of cameras; what stands by camera has at least two entries, of
// which the second has no width in a rig of one. Index 0 is the left camera of the best pair, and
// the right camera of each pair comes next to its left one (CameraGroups()).
struct Rig {
  std::vector<Camera> cameras = std::vector<Camera>(2);
  std::vector<RigidTransform> T_imu_camera = std::vector<RigidTransform>(2);
  ImuNoise imu_noise;
  ImuCorrection imu_correction;
  // 8 bit, of the camera's size: 0 where an image shows what moves with the rig instead of the
  // building. Empty: nowhere.
  std::vector<cv::Mat> masks = std::vector<cv::Mat>(2);
  double camera_time_offset_s = 0;  // stamp on the IMU's clock = camera stamp + this
  // The right image is taken so much after the left one. Cameras that are triggered together have
  // none.
  double right_time_offset_s = 0;
  std::vector<double> other_time_offsets_s = {};  // the same of the third camera on; none: 0
  // By how much the last row of a camera with a rolling shutter is exposed after the first;
  // negative where the last comes first, and 0 of a global shutter. Stamps are those of the middle
  // row.
  std::vector<double> readout_s = std::vector<double>(2);

  void Resize(size_t count) {
    const size_t entries = std::max<size_t>(count, 2);
    cameras.resize(entries);
    T_imu_camera.resize(entries);
    masks.resize(entries);
    readout_s.resize(entries);
    if (count < 2) cameras[1] = Camera();
  }
};

inline int CameraCount(const Rig& rig) {
  return rig.cameras[1].width_px > 0 ? static_cast<int>(rig.cameras.size()) : 1;
}
inline bool HasTwoCameras(const Rig& rig) { return CameraCount(rig) > 1; }

// Whether two cameras look in directions more than 60 degrees from each other: as a pair of little
// use, they are followed one by one.
inline bool LookApart(const RigidTransform& T_imu_first, const RigidTransform& T_imu_second) {
  constexpr double kLeastCosine = 0.5;
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return (T_imu_first.rotation * z).dot(T_imu_second.rotation * z) < kLeastCosine;
}

// Whether a camera stands so far before or behind another that looks the same way that the two
// cannot be rectified.
inline bool StandBehind(const RigidTransform& T_imu_first, const RigidTransform& T_imu_second) {
  constexpr double kMostAlong = 0.7;  // of the baseline, along the view
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d view = T_imu_first.rotation * z + T_imu_second.rotation * z;
  const Eigen::Vector3d baseline_m = T_imu_second.translation - T_imu_first.translation;
  return !(std::abs(baseline_m.normalized().dot(view.normalized())) <= kMostAlong);
}

// Cameras that are followed together: two that see the same, of which the right one is the next, or
// one alone.
struct CameraGroup {
  int first = 0;
  bool is_pair = false;
};

// Of two cameras alone it is told by their directions alone: what else is wrong is an error.
inline std::vector<CameraGroup> CameraGroups(const Rig& rig) {
  const int count = CameraCount(rig);
  std::vector<CameraGroup> groups;
  for (int camera = 0; camera < count; ++camera) {
    const auto at = static_cast<size_t>(camera);
    const bool is_pair =
        camera + 1 < count && !LookApart(rig.T_imu_camera[at], rig.T_imu_camera[at + 1]) &&
        (count == 2 || !StandBehind(rig.T_imu_camera[at], rig.T_imu_camera[at + 1]));
    groups.push_back({camera, is_pair});
    if (is_pair) ++camera;
  }
  return groups;
}

// Whether there are two cameras that see the same.
inline bool IsStereo(const Rig& rig) { return CameraGroups(rig).front().is_pair; }

// How much later than the first camera's image that of a camera is taken.
inline double TimeOffset_s(const Rig& rig, int camera) {
  if (camera < 2) return camera == 1 ? rig.right_time_offset_s : 0;
  const auto other = static_cast<size_t>(camera) - 2;
  return other < rig.other_time_offsets_s.size() ? rig.other_time_offsets_s[other] : 0;
}

// Whether all rows of all images are exposed at the stamp.
inline bool IsTakenAtOnce(const Rig& rig) {
  const auto is_none = [](double time_s) { return time_s == 0; };
  return rig.right_time_offset_s == 0 && std::ranges::all_of(rig.other_time_offsets_s, is_none) &&
         std::ranges::all_of(rig.readout_s, is_none);
}

// How long after the stamp of its pair a row of a camera's image, as it was recorded, is exposed.
inline double RowTime_s(const Rig& rig, int camera, double row_px) {
  const double share = (row_px + 0.5) / rig.cameras[camera].height_px - 0.5;  // of the readout
  return TimeOffset_s(rig, camera) + rig.readout_s[camera] * share;
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
  int camera = 0;  // whose left_px it is; right_px is of the next one
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
