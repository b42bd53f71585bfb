// The IMU samples that are still needed, how steady they are, and the linear errors of an IMU as
// the odometry estimates them: scale and axes of both sensors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <deque>
#include <vector>

#include "data/core/types.h"

namespace slcmap::inline odometry {

// Where an error stands: in the accelerometer's matrix or in the gyroscope's, row and column.
struct ImuErrorPlace {
  bool is_accel;
  int row, column;
};
inline constexpr std::array<ImuErrorPlace, kImuErrorsSize> kImuErrorPlaces{{{true, 0, 0},
                                                                            {true, 1, 1},
                                                                            {true, 2, 2},
                                                                            {true, 1, 0},
                                                                            {true, 2, 0},
                                                                            {true, 2, 1},
                                                                            {false, 0, 0},
                                                                            {false, 1, 1},
                                                                            {false, 2, 2},
                                                                            {false, 0, 1},
                                                                            {false, 0, 2},
                                                                            {false, 1, 0},
                                                                            {false, 1, 2},
                                                                            {false, 2, 0},
                                                                            {false, 2, 1}}};

inline ImuCorrection MakeCorrection(const ImuErrors& errors) {
  ImuCorrection correction;
  for (int i = 0; i < kImuErrorsSize; ++i) {
    const ImuErrorPlace& place = kImuErrorPlaces[i];
    (place.is_accel ? correction.accel : correction.gyro)(place.row, place.column) += errors[i];
  }
  return correction;
}

// Mean and standard deviation (of the vectors' distance from their mean).
struct ImuSpread {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sigma = 0;
};

// Of one of the samples' vectors; there must be at least one sample.
inline ImuSpread ComputeSpread(const std::vector<ImuSample>& samples,
                               Eigen::Vector3d ImuSample::*vector) {
  ImuSpread out;
  for (const ImuSample& s : samples) out.mean += s.*vector;
  out.mean /= static_cast<double>(samples.size());
  for (const ImuSample& s : samples) out.sigma += (s.*vector - out.mean).squaredNorm();
  out.sigma = std::sqrt(out.sigma / static_cast<double>(samples.size()));
  return out;
}

// The IMU samples that have arrived and are still needed.

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

}  // namespace slcmap::odometry
