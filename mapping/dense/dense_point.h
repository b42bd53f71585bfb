// A point of the dense cloud.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace slcmap {

// Files hold these numbers.
enum class DenseSource { kStereo = 0, kFilledPlane = 1 };

struct DensePoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();        // metres
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();  // towards the cameras that saw it
  double sigma_m = 0;                                       // along the normal
  uint8_t grey = 0;
  DenseSource source = DenseSource::kStereo;
};

}  // namespace slcmap
