#include "apps/evaluation/direction_metrics.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/angle_unit.h"
#include "data/line_angle.h"
#include "data/option_table.h"
#include "data/rigid_transform.h"

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr size_t kCandidates = 60;      // of the most weight, that pairs are made of
constexpr double kNearlySquare = 0.17;  // cosine between a pair
constexpr int kRefinements = 10;

constexpr OptionTable kDirectionTable{
    Option{"max_angle_deg", &DirectionOptions::max_angle_deg, 0.1, 20.0},
    Option{"min_weight", &DirectionOptions::min_weight, 0.0, 1.0}};

using Directions = std::vector<WeightedDirection>;

// At right angles, the first as given.
Matrix3d MakeAxes(const Vector3d& first, const Vector3d& second) {
  Matrix3d axes;
  axes.col(0) = first.normalized();
  axes.col(2) = first.cross(second).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

double FollowingWeight(const Matrix3d& axes, const Directions& directions, double max_angle_deg) {
  double weight = 0;
  for (const WeightedDirection& d : directions) {
    if (AxisOf(axes, d.direction, max_angle_deg)) weight += d.weight;
  }
  return weight;
}

std::optional<Matrix3d> BestPair(const Directions& directions, const DirectionOptions& options) {
  Directions heaviest = directions;
  const size_t count = std::min(kCandidates, heaviest.size());
  std::stable_sort(heaviest.begin(), heaviest.end(),
                   [](const auto& a, const auto& b) { return a.weight > b.weight; });
  std::optional<Matrix3d> best;
  double best_weight = 0;
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = i + 1; j < count; ++j) {
      const Vector3d &a = heaviest[i].direction, &b = heaviest[j].direction;
      if (std::abs(a.dot(b)) > kNearlySquare) continue;
      const Matrix3d axes = MakeAxes(a, b);
      const double weight = FollowingWeight(axes, directions, options.max_angle_deg);
      if (weight > best_weight) best_weight = weight, best = axes;
    }
  }
  return best;
}

// The sum over directions near an axis of weight times what the turn of the axes that lays it over
// the direction is.
Vector3d MeanTurn(const Matrix3d& axes, const Directions& directions, double max_angle_deg) {
  Matrix3d information = 1e-12 * Matrix3d::Identity();
  Vector3d gradient = Vector3d::Zero();
  for (const WeightedDirection& d : directions) {
    const std::optional<int> axis = AxisOf(axes, d.direction, max_angle_deg);
    if (!axis) continue;
    const Vector3d a = axes.col(*axis);
    const Vector3d b = a.dot(d.direction) < 0 ? Vector3d(-d.direction) : d.direction;
    // A turn w moves the axis by w x a; about the axis itself a direction tells nothing.
    information += d.weight * (Matrix3d::Identity() - a * a.transpose());
    gradient += d.weight * a.cross(b);
  }
  return information.ldlt().solve(gradient);
}

// The direction that those near an axis have in common; nothing of too little weight.
std::optional<Vector3d> OwnAxis(const Matrix3d& axes, int axis, const Directions& directions,
                                double least_weight, double max_angle_deg) {
  Matrix3d sum = Matrix3d::Zero();
  for (const WeightedDirection& d : directions) {
    if (AxisOf(axes, d.direction, max_angle_deg) == axis) {
      sum += d.weight * d.direction * d.direction.transpose();
    }
  }
  if (!(sum.trace() > 0) || sum.trace() < least_weight) return std::nullopt;
  return Vector3d(Eigen::SelfAdjointEigenSolver<Matrix3d>(sum).eigenvectors().col(2));
}

std::optional<double> Orthogonality_deg(const Matrix3d& axes, const Directions& directions,
                                        double least_weight, double max_angle_deg) {
  std::vector<Vector3d> own;
  for (int axis = 0; axis < 3; ++axis) {
    const auto direction = OwnAxis(axes, axis, directions, least_weight, max_angle_deg);
    if (direction) own.push_back(*direction);
  }
  std::optional<double> largest;
  for (size_t i = 0; i < own.size(); ++i) {
    for (size_t j = i + 1; j < own.size(); ++j) {
      const double off_deg = std::abs(std::asin(own[i].dot(own[j]))) * kDegreesPerRadian;
      largest = std::max(largest.value_or(0), off_deg);
    }
  }
  return largest;
}

double Angle_deg(const Vector3d& axis, const Vector3d& direction) {
  return LineAngle_rad(axis, direction) * kDegreesPerRadian;
}

}  // namespace

void DirectionOptions::Check() const { kDirectionTable.Check("directions", *this); }

std::optional<int> AxisOf(const Matrix3d& axes, const Vector3d& direction, double max_angle_deg) {
  Eigen::Index nearest = 0;
  const double cosine = (axes.transpose() * direction).cwiseAbs().maxCoeff(&nearest);
  if (cosine < std::cos(max_angle_deg / kDegreesPerRadian)) return std::nullopt;
  return static_cast<int>(nearest);
}

std::optional<DirectionMetrics> MeasureDirections(const Directions& directions,
                                                  const DirectionOptions& options) {
  options.Check();
  const std::optional<Matrix3d> start = BestPair(directions, options);
  if (!start) return std::nullopt;
  DirectionMetrics metrics;
  metrics.axes = *start;
  for (int i = 0; i < kRefinements; ++i) {
    const Vector3d turn = MeanTurn(metrics.axes, directions, options.max_angle_deg);
    metrics.axes = ExpRotation(turn).toRotationMatrix() * metrics.axes;
  }
  double all = 0, following = 0, squares = 0;
  for (const WeightedDirection& d : directions) {
    all += d.weight;
    const std::optional<int> axis = AxisOf(metrics.axes, d.direction, options.max_angle_deg);
    if (!axis) continue;
    const double angle_deg = Angle_deg(metrics.axes.col(*axis), d.direction);
    following += d.weight;
    squares += d.weight * angle_deg * angle_deg;
  }
  if (!(following > 0)) return std::nullopt;
  metrics.following = following / all;
  metrics.dispersion_deg = std::sqrt(squares / following);
  metrics.orthogonality_deg =
      Orthogonality_deg(metrics.axes, directions, options.min_weight * all, options.max_angle_deg);
  return metrics;
}

}  // namespace slcmap
