#include "data/check/gyro_integral.h"

#include <algorithm>

#include "data/imu_limits.h"

namespace slcmap {

GyroIntegral::GyroIntegral(const std::vector<ImuSample>& imu) {
  Eigen::Vector3d integral = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) {
    if (!IsPlausible(sample)) continue;
    if (!stamps_ns_.empty()) {
      integral += 0.5 * ToSeconds(sample.stamp_ns - stamps_ns_.back()) *
                  (rates_.back() + sample.angular_velocity_rad_s);
    }
    stamps_ns_.push_back(sample.stamp_ns);
    rates_.push_back(sample.angular_velocity_rad_s);
    integrals_.push_back(integral);
  }
}

bool GyroIntegral::Covers(int64_t from_ns, int64_t to_ns) const {
  return stamps_ns_.size() >= 2 && from_ns >= stamps_ns_.front() && to_ns <= stamps_ns_.back();
}

Eigen::Vector3d GyroIntegral::Between(int64_t from_ns, int64_t to_ns) const {
  return Until(to_ns) - Until(from_ns);
}

size_t GyroIntegral::Before(int64_t stamp_ns) const {
  const auto after = std::upper_bound(stamps_ns_.begin() + 1, stamps_ns_.end() - 1, stamp_ns);
  return static_cast<size_t>(after - stamps_ns_.begin()) - 1;
}

Eigen::Vector3d GyroIntegral::RateAt(int64_t stamp_ns) const {
  const size_t i = Before(stamp_ns);
  const double u = static_cast<double>(stamp_ns - stamps_ns_[i]) /
                   static_cast<double>(stamps_ns_[i + 1] - stamps_ns_[i]);
  return (1 - u) * rates_[i] + u * rates_[i + 1];
}

Eigen::Vector3d GyroIntegral::Until(int64_t stamp_ns) const {
  const size_t i = Before(stamp_ns);
  return integrals_[i] + 0.5 * ToSeconds(stamp_ns - stamps_ns_[i]) * (rates_[i] + RateAt(stamp_ns));
}

}  // namespace slcmap
