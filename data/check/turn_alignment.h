// Aligns the turns that images show with those that a gyroscope measured: in time, and in axes,
// which may be mixed up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "data/check/image_motion.h"

namespace slcmap::inline data {

// A change of axes P: what should have been read is P times what was read.
struct AxisChange {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  std::string words;  // such as "x negated"; "" where nothing is changed

  bool IsNone() const { return words.empty(); }
  bool IsRotation() const { return matrix.determinant() > 0; }
};

// All 48 changes of order and sign, the plainest first: none, one axis negated, all negated, two
// swapped, and then the rest.
const std::vector<AxisChange>& AxisChanges();

// One way to explain the images' turns by the gyroscope's: turn rate in the camera ~
// scale * R_camera_imu * change * reading, less a bias.
struct TurnFit {
  AxisChange change;
  double scale = 1;
  double time_offset_s = 0;  // stamp on the IMU's clock = camera stamp + this
  double unexplained = 1;    // share of the images' turns (variance about their mean)
};

// The share of the turns that the right axes may leave.
inline constexpr double kExplained = 0.1;

struct TurnAlignment {
  // Whether the images turn enough to tell anything. Nothing below means anything otherwise.
  bool enough_motion = false;
  double turn_rate_rad_s = 0;  // RMS of the images' turn rate about its mean

  TurnFit claimed;         // at the time that suits the axes as claimed best
  TurnFit best;            // of the changes of axes, the inverse of the claimed rotation among them
  double unexplained = 1;  // share by any linear map at any time

  // The following hold with the axes of `best`, refined.
  double time_offset_s = 0;
  double time_offset_sigma_s = 0;
  // The rotation that would explain the turns; where the change is no rotation, the gyroscope's
  // readings are to be changed first.
  Eigen::Quaterniond R_imu_camera = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rotation_sigma_rad = Eigen::Vector3d::Zero();  // about the IMU's axes
  // Turn rate in the camera = camera_from_gyro * reading - camera_bias_rad_s.
  Eigen::Matrix3d camera_from_gyro = Eigen::Matrix3d::Identity();
  Eigen::Vector3d camera_bias_rad_s = Eigen::Vector3d::Zero();
  // The images' turns over the gyroscope's, about each axis of the camera, with their deviation.
  Eigen::Vector3d scales = Eigen::Vector3d::Ones();
  Eigen::Vector3d scale_sigmas = Eigen::Vector3d::Ones();
};

inline constexpr double kMaxAlignedOffset_s = 0.3;  // either way from the one claimed

// `imu` is in the order of its stamps. A least squares hand-eye alignment: rates of both over each
// step between images are compared at all offsets within kMaxAlignedOffset_s and for all changes of
// axes (by their second moments), and the best refined by Gauss-Newton over offset, rotation and
// bias with the information of each turn.
TurnAlignment AlignTurns(const std::vector<ImageTurn>& turns, const std::vector<ImuSample>& imu,
                         const Eigen::Quaterniond& R_imu_camera, double time_offset_s);

// For clocks that are seconds apart: the offset within 6 s of the one claimed at which the axes as
// claimed explain the turns, where there is one and no other, to 10 ms.
std::optional<double> FindFarOffset(const std::vector<ImageTurn>& turns,
                                    const std::vector<ImuSample>& imu,
                                    const Eigen::Quaterniond& R_imu_camera, double time_offset_s);

}  // namespace slcmap::data
