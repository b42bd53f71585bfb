#include "mapping/lines/neighbour_directions.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "mapping/lines/across.h"

namespace slcmap {
namespace {

constexpr double kUnknown_rad = 1;    // of a direction that places do not tell
constexpr double kRobustSquared = 4;  // squared sigmas off the axis at which a line counts half

// How far a line is off its axis, as its places alone have it, along the axis' `across`.
struct OffAxis {
  size_t line = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d off_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();  // its variance but for what lines share
};

// What lines of an axis share of their variance about it, and what is each one's own.
class DeviationModel {
 public:
  DeviationModel(double sigma_rad, const NeighbourOptions& options)
      : variance_(sigma_rad * sigma_rad), options_(options) {}

  double SharedBetween(const Eigen::Vector3d& a_world, const Eigen::Vector3d& b_world) const {
    const double near = std::exp(-(a_world - b_world).norm() / options_.reach_m);
    return variance_ * (options_.building_share + options_.shared_share * near);
  }

  double Variance() const { return variance_; }
  double OwnVariance() const {
    return variance_ * std::max(0.0, 1 - options_.building_share - options_.shared_share);
  }

 private:
  double variance_;
  NeighbourOptions options_;
};

// The information of the direction where the place across is not known: the Schur complement.
Eigen::Matrix2d OfDirection(const Eigen::Matrix4d& information) {
  const Eigen::Matrix2d of_place =
      information.topLeftCorner<2, 2>() + 1e-6 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d mixed = information.topRightCorner<2, 2>();
  return information.bottomRightCorner<2, 2>() - mixed.transpose() * of_place.inverse() * mixed;
}

// With a line's own deviation, and more for one that cannot well be of this axis.
Eigen::Matrix2d NoiseOf(const Eigen::Vector2d& off_rad, const Eigen::Matrix2d& covariance,
                        const DeviationModel& model) {
  const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d expected = covariance + model.Variance() * unit;
  const double squared_sigmas = off_rad.dot(expected.inverse() * off_rad);
  return (1 + squared_sigmas / kRobustSquared) * (covariance + model.OwnVariance() * unit);
}

// The fit is the mean of what the places and the prior at the axis tell, by their information: this
// takes the prior out of it.
OffAxis OffAxisOf(const TrackedLine& line, size_t index, const BuildingAxis& axis,
                  const DeviationModel& model) {
  const Eigen::Matrix<double, 3, 2> across = AcrossOf(axis.direction_world);
  const double sense = line.line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const Eigen::Vector2d fitted_rad = across.transpose() * (sense * line.line.direction_world);
  const Eigen::Matrix2d turn = across.transpose() * line.fit.across;
  const Eigen::Matrix2d places = turn * OfDirection(line.fit.places_information) * turn.transpose();
  const Eigen::Matrix2d prior = Eigen::Matrix2d::Identity() / model.Variance();
  const Eigen::Matrix2d unknown = Eigen::Matrix2d::Identity() / (kUnknown_rad * kUnknown_rad);
  const Eigen::Matrix2d covariance = (places + unknown).inverse();
  OffAxis off{index, line.line.point_world};
  off.off_rad = covariance * (places + prior) * fitted_rad;
  off.noise = NoiseOf(off.off_rad, covariance, model);
  return off;
}

// The others, the nearest first.
std::vector<const OffAxis*> NearestTo(const OffAxis& line, const std::vector<OffAxis>& all,
                                      int most) {
  std::vector<std::pair<double, size_t>> others;
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].line == line.line) continue;
    others.emplace_back((all[i].middle_world - line.middle_world).squaredNorm(), i);
  }
  const size_t count = std::min(others.size(), static_cast<size_t>(most));
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                    others.end());
  std::vector<const OffAxis*> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(&all[others[i].second]);
  return nearest;
}

// What the neighbours were measured to be off, its covariance, and that with the line's own.
struct Neighbourhood {
  Eigen::VectorXd off_rad;
  Eigen::MatrixXd covariance, with_line;
};

Neighbourhood NeighbourhoodOf(const OffAxis& line, const std::vector<const OffAxis*>& nearest,
                              const DeviationModel& model) {
  const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
  const auto count = static_cast<Eigen::Index>(nearest.size());
  Neighbourhood around{Eigen::VectorXd(2 * count), Eigen::MatrixXd(2 * count, 2 * count),
                       Eigen::MatrixXd(2 * count, 2)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d& middle_world = nearest[i]->middle_world;
    for (Eigen::Index k = 0; k < count; ++k) {
      around.covariance.block<2, 2>(2 * i, 2 * k) =
          model.SharedBetween(middle_world, nearest[k]->middle_world) * unit;
    }
    around.covariance.block<2, 2>(2 * i, 2 * i) += nearest[i]->noise;
    around.with_line.middleRows<2>(2 * i) =
        model.SharedBetween(middle_world, line.middle_world) * unit;
    around.off_rad.segment<2>(2 * i) = nearest[i]->off_rad;
  }
  return around;
}

// The prediction of a Gaussian process that leaves the line itself out.
DirectionPrior Predict(const OffAxis& line, const std::vector<OffAxis>& all,
                       const BuildingAxis& axis, const DeviationModel& model, int max_neighbours) {
  constexpr double kMinShare = 1e-4;  // of the variance, against rounding
  const auto nearest = NearestTo(line, all, max_neighbours);
  if (nearest.empty()) return {axis.direction_world, std::sqrt(model.Variance())};
  const Neighbourhood around = NeighbourhoodOf(line, nearest, model);
  const Eigen::MatrixXd gain = around.covariance.llt().solve(around.with_line).transpose();
  const double known = (gain * around.with_line).trace() / 2;
  const Eigen::Vector2d mean_rad = gain * around.off_rad;
  const Eigen::Vector3d direction =
      axis.direction_world + AcrossOf(axis.direction_world) * mean_rad;
  const double variance = std::max(model.Variance() - known, kMinShare * model.Variance());
  return {direction.normalized(), std::sqrt(variance)};
}

}  // namespace

std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options) {
  // Segments of a run are shifted and turned against each other.
  std::map<std::pair<int, int>, std::vector<OffAxis>> groups;  // by axis and segment
  for (size_t i = 0; i < lines.size(); ++i) {
    const TrackedLine& line = lines[i];
    if (line.axis < 0) continue;
    const BuildingAxis& axis = axes[line.axis];
    groups[{line.axis, line.segment}].push_back(
        OffAxisOf(line, i, axis, DeviationModel(axis.sigma_rad, options)));
  }
  std::vector<std::optional<DirectionPrior>> priors(lines.size());
  for (const auto& [key, all] : groups) {
    const BuildingAxis& axis = axes[key.first];
    const DeviationModel model(axis.sigma_rad, options);
    cv::parallel_for_({0, static_cast<int>(all.size())}, [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        priors[all[i].line] = Predict(all[i], all, axis, model, options.max_neighbours);
      }
    });
  }
  return priors;
}

}  // namespace slcmap
