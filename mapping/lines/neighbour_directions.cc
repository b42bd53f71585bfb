#include "mapping/lines/neighbour_directions.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "mapping/lines/across.h"

namespace slcmap {
namespace {

constexpr double kUnknown_rad = 1;    // of a direction that places do not tell
constexpr double kRobustSquared = 4;  // squared sigmas from the axis at which a line counts half

// How far a line is off its axis, as its places alone have it, along the axis' `across`.
struct OffAxis {
  size_t line = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d off_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

// The information of the direction where the place across is not known.
Eigen::Matrix2d OfDirection(const Eigen::Matrix4d& information) {
  const Eigen::Matrix2d of_place =
      information.topLeftCorner<2, 2>() + 1e-6 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d mixed = information.topRightCorner<2, 2>();
  return information.bottomRightCorner<2, 2>() - mixed.transpose() * of_place.inverse() * mixed;
}

// The fit is the mean of what the places and the prior at the axis tell, by their information: this
// takes the prior out of it.
OffAxis OffAxisOf(const TrackedLine& line, size_t index, const BuildingAxis& axis) {
  const Eigen::Matrix<double, 3, 2> across = AcrossOf(axis.direction_world);
  const double sense = line.line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const Eigen::Vector2d fitted_rad = across.transpose() * (sense * line.line.direction_world);
  const Eigen::Matrix2d turn = across.transpose() * line.fit.across;
  const Eigen::Matrix2d places = turn * OfDirection(line.fit.places_information) * turn.transpose();
  const Eigen::Matrix2d prior = Eigen::Matrix2d::Identity() / (axis.sigma_rad * axis.sigma_rad);
  const Eigen::Matrix2d unknown = Eigen::Matrix2d::Identity() / (kUnknown_rad * kUnknown_rad);
  OffAxis off{index, line.line.point_world};
  off.covariance = (places + unknown).inverse();
  off.off_rad = off.covariance * (places + prior) * fitted_rad;
  return off;
}

// What lines of an axis share, and what is each one's own.
class DeviationModel {
 public:
  DeviationModel(double sigma_rad, const NeighbourOptions& options)
      : variance_(sigma_rad * sigma_rad), options_(options) {}

  double Between(const Eigen::Vector3d& a_world, const Eigen::Vector3d& b_world) const {
    const double near = std::exp(-(a_world - b_world).norm() / options_.reach_m);
    return variance_ * (options_.building_share + options_.shared_share * near);
  }

  double All() const { return variance_; }
  double Own() const { return variance_ * (1 - options_.building_share - options_.shared_share); }

 private:
  double variance_;
  const NeighbourOptions& options_;
};

// With a line's own deviation as noise, and more of what cannot well be of this axis.
Eigen::Matrix2d NoiseOf(const OffAxis& deviation, const DeviationModel& shared) {
  const Eigen::Matrix2d expected =
      deviation.covariance + shared.All() * Eigen::Matrix2d::Identity();
  const double squared_sigmas = deviation.off_rad.dot(expected.inverse() * deviation.off_rad);
  return (1 + squared_sigmas / kRobustSquared) *
         (deviation.covariance + shared.Own() * Eigen::Matrix2d::Identity());
}

// The others, the nearest first.
std::vector<const OffAxis*> NearestTo(const OffAxis& deviation, const std::vector<OffAxis>& all,
                                      int most) {
  std::vector<std::pair<double, const OffAxis*>> others;
  for (const OffAxis& other : all) {
    if (other.line == deviation.line) continue;
    others.emplace_back((other.middle_world - deviation.middle_world).squaredNorm(), &other);
  }
  const size_t count = std::min(others.size(), static_cast<size_t>(most));
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                    others.end());
  std::vector<const OffAxis*> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(others[i].second);
  return nearest;
}

DirectionPrior PriorAmong(const OffAxis& deviation, const std::vector<OffAxis>& all,
                          const BuildingAxis& axis, const NeighbourOptions& options) {
  const DeviationModel shared(axis.sigma_rad, options);
  const auto nearest = NearestTo(deviation, all, options.max_neighbours);
  const auto count = static_cast<Eigen::Index>(nearest.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(2 * count, 2 * count);
  Eigen::MatrixXd with_line(2 * count, 2);
  Eigen::VectorXd off_rad(2 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k < count; ++k) {
      covariance.block<2, 2>(2 * i, 2 * k) =
          shared.Between(nearest[i]->middle_world, nearest[k]->middle_world) *
          Eigen::Matrix2d::Identity();
    }
    covariance.block<2, 2>(2 * i, 2 * i) += NoiseOf(*nearest[i], shared);
    with_line.middleRows<2>(2 * i) =
        shared.Between(nearest[i]->middle_world, deviation.middle_world) *
        Eigen::Matrix2d::Identity();
    off_rad.segment<2>(2 * i) = nearest[i]->off_rad;
  }
  const Eigen::MatrixXd gain = covariance.llt().solve(with_line).transpose();
  const double known = count == 0 ? 0 : (gain * with_line).trace() / 2;
  const Eigen::Vector2d mean_rad =
      count == 0 ? Eigen::Vector2d(Eigen::Vector2d::Zero()) : Eigen::Vector2d(gain * off_rad);
  const Eigen::Vector3d direction =
      axis.direction_world + AcrossOf(axis.direction_world) * mean_rad;
  return {direction.normalized(), std::sqrt(shared.All() - known)};
}

}  // namespace

std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options) {
  std::vector<std::vector<OffAxis>> by_axis(axes.size());
  for (size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].axis < 0) continue;
    by_axis[lines[i].axis].push_back(OffAxisOf(lines[i], i, axes[lines[i].axis]));
  }
  std::vector<std::optional<DirectionPrior>> priors(lines.size());
  for (size_t axis = 0; axis < axes.size(); ++axis) {
    const std::vector<OffAxis>& all = by_axis[axis];
    cv::parallel_for_({0, static_cast<int>(all.size())}, [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        priors[all[i].line] = PriorAmong(all[i], all, axes[axis], options);
      }
    });
  }
  return priors;
}

}  // namespace slcmap
