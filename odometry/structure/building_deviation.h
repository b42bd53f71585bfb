// How far the lines of a building are off the axes that they follow: learned from the lines
// themselves.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <unordered_set>
#include <vector>

#include "data/core/types.h"
#include "odometry/structure/options.h"

namespace slcmap::inline odometry {

// Lines so near each other share what they deviate by.
inline constexpr double kSharedRadius_m = 3;
// Of a line's deviation, where the Cauchy loss turns
inline constexpr double kDeviationLossSigma = 2;

// What is known of a line's direction across its axis, about either of the axes across it.
struct LineDeviation {
  Eigen::Vector2d off_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();
  // Of that, what it shares with its neighbours, how well each component of it is known, and its
  // covariance with that of off_rad. Zero for a line that shares nothing.
  Eigen::Vector2d shared_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d shared_variance_rad2 = Eigen::Vector2d::Zero();
  Eigen::Vector2d cross_covariance_rad2 = Eigen::Vector2d::Zero();
};

// The standard deviation s of lines' directions from their axes, about either axis across them.
class BuildingDeviation {
 public:
  explicit BuildingDeviation(const BuildingDeviationOptions& options)
      : options_(options), sigma_rad_(options.start_sigma_rad) {}

  // Takes in a line of the window, as it is estimated with a term of tie_sigma_rad on each
  // component of what it does not share, whose effect is removed. What it said before is replaced,
  // unless it is now tied so tightly that it tells nothing.
  void Add(int64_t id, const LineDeviation& line, double tie_sigma_rad);

  // Those are no longer in the window: what they said last stays.
  void Close(const std::unordered_set<int64_t>& ids);

  // Learns from what was added.
  void Solve();

  double sigma_rad() const { return sigma_rad_; }

  // A line that is further off an axis does not follow it.
  double max_deviation_rad() const { return options_.max_sigmas * sigma_rad_; }

  // What lines share with their neighbours.
  bool IsShared() const { return options_.shared_share > 0; }
  double shared_sigma_rad() const;
  // How far along itself a line is straight.
  double max_piece_m() const {
    return IsTakenAsExact() ? std::numeric_limits<double>::infinity() : options_.max_piece_m;
  }
  double shared_radius_m() const { return kSharedRadius_m; }

  // What a line that is new is to be tied with, beside what it shares; 0: it is exactly along its
  // axis. Ties that are as tight as an exact building's cost accuracy, since what images show of a
  // line's direction is biased now and then: that averages out over lines that are exact.
  double OfNewLine(int64_t id) const;

  // What a line is to be tied with that was not taken as exact when it was new. Where the building
  // has turned out to be exact since, that is as tight as can be, but for the lines that would tell
  // if it were not.
  double OfLine(int64_t id) const;

 private:
  bool IsTakenAsExact() const { return sigma_rad_ < options_.exact_below_rad; }
  bool TakesAsExact(int64_t id) const;
  double own_sigma_rad() const;
  // One component of a line's deviation, as its observations have it.
  struct Sample {
    double squared_rad2, variance_rad2;
  };
  std::vector<Sample> CollectSamples(const LineDeviation& line, double tie_sigma_rad) const;
  double Excess(double sigma_rad) const;

  BuildingDeviationOptions options_;
  std::map<int64_t, std::vector<Sample>> open_;  // of lines in the window
  std::deque<Sample> closed_;                    // oldest first
  double sigma_rad_;
};

// What is believed of a building's lines, by what they follow: handrails are put up by themselves,
// and what deviates from a slope says nothing of the axes.
class LineDeviations {
 public:
  explicit LineDeviations(const BuildingDeviationOptions& options);

  // Of lines that follow an axis or none, or a slope.
  const BuildingDeviation& Of(LineAxis axis) const { return of_[FindKind(axis)]; }
  BuildingDeviation& Of(LineAxis axis) { return of_[FindKind(axis)]; }

  // See BuildingDeviation.
  void Close(const std::unordered_set<int64_t>& ids);
  void Solve();

 private:
  static size_t FindKind(LineAxis axis) { return axis == LineAxis::kSloped ? 1 : 0; }

  std::array<BuildingDeviation, 2> of_;  // of the axes, of slopes
};

}  // namespace slcmap::odometry
