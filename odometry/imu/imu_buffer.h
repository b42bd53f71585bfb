// The IMU samples that have arrived and are still needed.
#pragma once

#include <deque>
#include <vector>

#include "data/types.h"

namespace slcmap {

class ImuBuffer {
 public:
  // Appends a sample; false (and nothing appended) where it is not finite or not later than the
  // last.
  bool Add(const ImuSample& sample);

  bool empty() const { return samples_.empty(); }
  int64_t first_stamp_ns() const { return samples_.front().stamp_ns; }
  int64_t last_stamp_ns() const { return samples_.back().stamp_ns; }
  bool Covers(int64_t stamp_ns) const;  // a sample at or after the stamp has arrived

  // The samples from one stamp to another, the first and the last interpolated to lie exactly on
  // them. A stamp before the first sample gets the first sample's values.
  std::vector<ImuSample> Between(int64_t from_ns, int64_t to_ns) const;

  // The mean angular velocity over some time up to a stamp, as far as its samples are there; zero
  // where there are none. What has arrived since changes nothing.
  Eigen::Vector3d MeanRate(int64_t stamp_ns, int64_t over_ns) const;

  // The longest time between neighbouring samples within the stamps, in seconds.
  double LongestGap(int64_t from_ns, int64_t to_ns) const;

  // Forgets samples that no stamp at or after this one needs.
  void DropBefore(int64_t stamp_ns);

 private:
  ImuSample At(int64_t stamp_ns) const;

  std::deque<ImuSample> samples_;
};

}  // namespace slcmap
