// The integral of a gyroscope's readings over time.
#pragma once

#include <vector>

#include "data/types.h"

namespace slcmap {

// Readings are interpolated linearly; absurd ones are left out. Over the time between two images
// the integral is the rotation vector, but for the little that comes of an axis that turns.
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<ImuSample>& imu);

  bool Covers(int64_t from_ns, int64_t to_ns) const;
  Eigen::Vector3d Between(int64_t from_ns, int64_t to_ns) const;  // rad, within what is covered
  Eigen::Vector3d RateAt(int64_t stamp_ns) const;                 // rad/s

 private:
  size_t Before(int64_t stamp_ns) const;
  Eigen::Vector3d Until(int64_t stamp_ns) const;

  std::vector<int64_t> stamps_ns_;
  std::vector<Eigen::Vector3d> rates_, integrals_;
};

}  // namespace slcmap
