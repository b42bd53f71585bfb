// How steady IMU samples are.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "data/types.h"

namespace slcmap {

// Mean and standard deviation (of the vectors' distance from their mean).
struct ImuSpread {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sigma = 0;
};

// Of one of the samples' vectors; there must be at least one sample.
inline ImuSpread SpreadOf(const std::vector<ImuSample>& samples,
                          Eigen::Vector3d ImuSample::*vector) {
  ImuSpread out;
  for (const ImuSample& s : samples) out.mean += s.*vector;
  out.mean /= static_cast<double>(samples.size());
  for (const ImuSample& s : samples) out.sigma += (s.*vector - out.mean).squaredNorm();
  out.sigma = std::sqrt(out.sigma / static_cast<double>(samples.size()));
  return out;
}

}  // namespace slcmap
