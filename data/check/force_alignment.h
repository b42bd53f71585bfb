// Aligns the accelerations that stereo images show with those that an accelerometer measured.
#pragma once

#include <vector>

#include "data/check/image_motion.h"
#include "data/check/turn_alignment.h"

namespace slcmap::inline data {

struct ForceFit {
  AxisChange change;  // of the accelerometer's axes, against the camera's as claimed
  double misfit_m_s2 = 0;
};

// Whether the motion tells that one is right and the other is not.
bool IsClearlyBetter(const ForceFit& fit, const ForceFit& than);

struct ForceAlignment {
  bool enough_motion = false;  // nothing below means anything otherwise
  ForceFit claimed;
  ForceFit turned;  // with the change of axes that explains the turns best
  ForceFit best;    // of all changes, where one is clearly better than `claimed`, else `claimed`
  // With the axes of `best`: what the images' accelerations are to be multiplied with to agree (as
  // is the baseline), and where the camera is seen from the IMU, in the IMU's axes.
  double image_scale = 1, image_scale_sigma = 1;
  Eigen::Vector3d lever_m = Eigen::Vector3d::Zero(), lever_sigma_m = Eigen::Vector3d::Ones();
};

// Over each two steps, the change of the camera's velocity is compared with the readings, turned
// into a common frame by the gyroscope as `turns` aligned it, less a gravity that is the same
// throughout a part: by it an axis is known that is wrong, as gravity would turn with the rig; the
// rest tells all signs from each other, the scale and the lever.
ForceAlignment AlignForces(const std::vector<StereoStep>& steps, const std::vector<ImuSample>& imu,
                           const TurnAlignment& turns, const RigidTransform& T_imu_camera);

}  // namespace slcmap::data
