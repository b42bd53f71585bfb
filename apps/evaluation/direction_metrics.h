// How well freely placed segments, or normals, keep to three directions at right angles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace slcmap {

struct WeightedDirection {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit; its sign means nothing
  double weight = 1;                                     // such as a length
};

struct DirectionOptions {
  double max_angle_deg = 5;  // from an axis; what is further off follows none
  double min_weight = 0.02;  // share of the weight that an axis needs to be fitted by itself
  void Check() const;        // throws ConfigError
};

struct DirectionMetrics {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, at right angles; of any sign
  double following = 0;                                // share of the weight near an axis
  double dispersion_deg = 0;                           // weighted RMS angle of these to their axes
  // From 90 degrees, of axes that are fitted each by itself; nothing where two have too few.
  std::optional<double> orthogonality_deg;  // the largest
};

// The axes are those, of all pairs of directions, that most weight follows, then refined by least
// squares. The world may be turned as it likes. Nothing without two directions at about a right
// angle.
std::optional<DirectionMetrics> MeasureDirections(const std::vector<WeightedDirection>& directions,
                                                  const DirectionOptions& options);

// The axis (0, 1, 2) within max_angle_deg of a direction; nothing where there is none.
std::optional<int> AxisOf(const Eigen::Matrix3d& axes, const Eigen::Vector3d& direction,
                          double max_angle_deg);

}  // namespace slcmap
