// How far the lines of a building are off the axes that they follow: learned from the lines
// themselves.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>

#include "odometry/options.h"

namespace slcmap {

// What is known of a line's direction across its axis, about either of the axes across it.
struct LineDeviation {
  Eigen::Vector2d off_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();
};

// The standard deviation s of lines' directions from their axes, about either axis across them.
class BuildingDeviation {
 public:
  explicit BuildingDeviation(const BuildingDeviationOptions& options)
      : options_(options), sigma_rad_(options.start_sigma_rad) {}

  // Takes in a line, as it is estimated with a term of tie_sigma_rad on each component, which is
  // taken out again.
  void Add(const LineDeviation& line, double tie_sigma_rad);

  double sigma_rad() const { return sigma_rad_; }

  // What a line that is new is to be tied with; 0: it is exactly along its axis. Ties that are as
  // tight as an exact building's cost accuracy, since what images show of a line's direction is
  // biased now and then: that averages out over lines that are exact.
  double OfNewLine(int64_t id) const;

 private:
  // One component of a line's deviation, as its observations have it.
  struct Sample {
    double squared_rad2, variance_rad2;
  };
  void Solve();
  double Excess(double sigma_rad) const;

  BuildingDeviationOptions options_;
  std::deque<Sample> samples_;  // oldest first
  double sigma_rad_;
};

}  // namespace slcmap
