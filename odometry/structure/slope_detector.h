// Finds slopes: directions, neither vertical nor level, that many lines share, as handrails and
// stringers of stairs, ramps and rafters do.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "odometry/geometry/lines.h"
#include "odometry/structure/options.h"

namespace slcmap::inline odometry {

// Of lines' own deviation from what they share.
inline constexpr double kSlopeSearchSigma_rad = 0.005;

// A line that follows no direction of the building, as its own observations have it.
struct FreeLine {
  int64_t id = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();               // of length 1
  Eigen::Matrix3d direction_covariance_rad2 = Eigen::Matrix3d::Identity();  // rank 2
  double length_m = 0;
};

// A slope and what speaks for it.
struct SlopeEvidence {
  SlopeBlock angles_rad{};
  double sigma_rad = 0;  // where it is largest
  int lines = 0;         // that follow it
  int objects = 0;       // that these belong to: edges beside each other are one
};

class SlopeDetector {
 public:
  // The lines that a keyframe sees, and the directions of the building (unit, in the gravity
  // aligned world) and the slopes that are known already. A line is remembered as it was given
  // last. Returns a slope that is now certain and was not before.
  std::optional<SlopeEvidence> AddKeyframe(const std::vector<FreeLine>& lines,
                                           const std::vector<Eigen::Vector3d>& axes_world,
                                           const std::vector<SlopeBlock>& slopes);

  // The best slope at present, certain or not.
  std::optional<SlopeEvidence> Best(const std::vector<Eigen::Vector3d>& axes_world,
                                    const std::vector<SlopeBlock>& slopes) const;

  // Forgets all lines.
  void Reset();

 private:
  struct Remembered {
    FreeLine line;
    int64_t keyframe = 0;
  };

  int64_t keyframes_ = 0;
  std::map<int64_t, Remembered> lines_;  // by id
};

// How far a line is off a slope, squared in standard deviations, when it is off by
// deviation_sigma_rad by itself; nothing where the angle is above the limit or the line so
// uncertain that it tells nothing.
std::optional<double> SquaredSigmasOff(const FreeLine& line, const SlopeBlock& slope,
                                       double deviation_sigma_rad);

// Whether a line is known well enough, and known to be far from level and vertical, from the
// building's axes and from slopes.
bool MaySlope(const FreeLine& line, const std::vector<Eigen::Vector3d>& axes_world,
              const std::vector<SlopeBlock>& slopes);

}  // namespace slcmap::odometry
