#include "odometry/geometry/imu.h"

#include <algorithm>

#include "data/core/types.h"

namespace slcmap::inline odometry {
namespace {

auto FirstNotBefore(const std::deque<ImuSample>& samples, int64_t stamp_ns) {
  return std::lower_bound(samples.begin(), samples.end(), stamp_ns,
                          [](const ImuSample& s, int64_t t) { return s.stamp_ns < t; });
}

}  // namespace

bool ImuBuffer::Add(const ImuSample& sample) {
  if (!IsPlausible(sample)) return false;
  if (!samples_.empty() && sample.stamp_ns <= samples_.back().stamp_ns) return false;
  samples_.push_back(sample);
  return true;
}

bool ImuBuffer::Covers(int64_t stamp_ns) const {
  return !samples_.empty() && samples_.back().stamp_ns >= stamp_ns;
}

ImuSample ImuBuffer::At(int64_t stamp_ns) const {
  const auto next = FirstNotBefore(samples_, stamp_ns);
  ImuSample out = next == samples_.end() ? samples_.back() : *next;
  if (next != samples_.begin() && next != samples_.end()) {
    const ImuSample& previous = *(next - 1);
    const double u = static_cast<double>(stamp_ns - previous.stamp_ns) /
                     static_cast<double>(next->stamp_ns - previous.stamp_ns);
    out.angular_velocity_rad_s =
        (1 - u) * previous.angular_velocity_rad_s + u * next->angular_velocity_rad_s;
    out.specific_force_m_s2 =
        (1 - u) * previous.specific_force_m_s2 + u * next->specific_force_m_s2;
  }
  out.stamp_ns = stamp_ns;
  return out;
}

std::vector<ImuSample> ImuBuffer::Between(int64_t from_ns, int64_t to_ns) const {
  std::vector<ImuSample> out;
  if (samples_.empty() || to_ns <= from_ns) return out;
  out.push_back(At(from_ns));
  for (auto it = FirstNotBefore(samples_, from_ns + 1);
       it != samples_.end() && it->stamp_ns < to_ns; ++it) {
    out.push_back(*it);
  }
  out.push_back(At(to_ns));
  return out;
}

Eigen::Vector3d ImuBuffer::MeanRate(int64_t stamp_ns, int64_t over_ns) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (auto it = FirstNotBefore(samples_, stamp_ns - over_ns);
       it != samples_.end() && it->stamp_ns <= stamp_ns; ++it) {
    sum += it->angular_velocity_rad_s;
    ++count;
  }
  return count > 0 ? Eigen::Vector3d(sum / count) : sum;
}

double ImuBuffer::LongestGap(int64_t from_ns, int64_t to_ns) const {
  if (samples_.empty()) return ToSeconds(to_ns - from_ns);
  int64_t longest_ns = 0;
  auto it = FirstNotBefore(samples_, from_ns);
  int64_t last_ns = it == samples_.begin() ? from_ns : (it - 1)->stamp_ns;
  for (; it != samples_.end() && last_ns < to_ns; ++it) {
    longest_ns = std::max(longest_ns, it->stamp_ns - last_ns);
    last_ns = it->stamp_ns;
  }
  return ToSeconds(std::max(longest_ns, to_ns - last_ns));
}

void ImuBuffer::DropBefore(int64_t stamp_ns) {
  while (samples_.size() > 2 && samples_[1].stamp_ns <= stamp_ns) samples_.pop_front();
}

}  // namespace slcmap::odometry
