// What no IMU on a building's mapper measures.
#pragma once

#include "data/types.h"

namespace slcmap {

inline constexpr double kMaxGyro_rad_s = 100, kMaxAccel_m_s2 = 1000;

// False where a value is not finite or beyond the limits.
inline bool IsPlausible(const ImuSample& sample) {
  return sample.angular_velocity_rad_s.norm() < kMaxGyro_rad_s &&
         sample.specific_force_m_s2.norm() < kMaxAccel_m_s2;
}

}  // namespace slcmap
