#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "apps/evaluation/report.h"
#include "apps/evaluation/straightness.h"
#include "data/core/math.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr size_t kCandidates = 60;      // of the most weight, that pairs are made of
constexpr double kNearlySquare = 0.17;  // cosine between a pair
constexpr int kRefinements = 10;

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
    if (FindAxis(axes, d.direction, max_angle_deg)) weight += d.weight;
  }
  return weight;
}

std::optional<Matrix3d> BestPair(const Directions& directions, double max_angle_deg) {
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
      const double weight = FollowingWeight(axes, directions, max_angle_deg);
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
    const std::optional<int> axis = FindAxis(axes, d.direction, max_angle_deg);
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
    if (FindAxis(axes, d.direction, max_angle_deg) == axis) {
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

std::optional<int> FindAxis(const Matrix3d& axes, const Vector3d& direction, double max_angle_deg) {
  Eigen::Index nearest = 0;
  const double cosine = (axes.transpose() * direction).cwiseAbs().maxCoeff(&nearest);
  if (cosine < std::cos(max_angle_deg / kDegreesPerRadian)) return std::nullopt;
  return static_cast<int>(nearest);
}

std::optional<DirectionMetrics> MeasureDirections(const Directions& directions,
                                                  double max_angle_deg, double min_weight) {
  const std::optional<Matrix3d> start = BestPair(directions, max_angle_deg);
  if (!start) return std::nullopt;
  DirectionMetrics metrics;
  metrics.axes = *start;
  for (int i = 0; i < kRefinements; ++i) {
    const Vector3d turn = MeanTurn(metrics.axes, directions, max_angle_deg);
    metrics.axes = ExpRotation(turn).toRotationMatrix() * metrics.axes;
  }
  double all = 0, following = 0, squares = 0;
  for (const WeightedDirection& d : directions) {
    all += d.weight;
    const std::optional<int> axis = FindAxis(metrics.axes, d.direction, max_angle_deg);
    if (!axis) continue;
    const double angle_deg = Angle_deg(metrics.axes.col(*axis), d.direction);
    following += d.weight;
    squares += d.weight * angle_deg * angle_deg;
  }
  if (!(following > 0)) return std::nullopt;
  metrics.following = following / all;
  metrics.dispersion_deg = std::sqrt(squares / following);
  metrics.orthogonality_deg =
      Orthogonality_deg(metrics.axes, directions, min_weight * all, max_angle_deg);
  return metrics;
}

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector4d;

constexpr int kIterations = 10;
constexpr double kOtherThing_m = 0.02;

constexpr size_t kMinObservations = 4;  // of an edge
constexpr double kPoseSigma_m = 0.001;  // no place counts as if it were known better
// Bounds of the times between two observations of an edge; the last is open.
constexpr std::array kTimes_s = {0.0, 1.0, 3.0, 10.0, 30.0};
// An observation this far from its edge, in standard deviations (of the place, and of 2 cm beside
// it), is of something else.
constexpr double kMostSigmasOff = 5;

struct End {
  int64_t stamp_ns = 0;
  PlacedInWorld place;
};

// Both ends of each observation of one edge, in turn.
using Ends = std::vector<End>;

// A distance across a line, with its weight.
struct Across {
  Vector2d residual_m = Vector2d::Zero();
  Matrix2d covariance_m2 = Matrix2d::Zero();
  double along_m = 0;
};

// RMS of vectors of two components of which each counts by how well it is known.
class WeightedRms {
 public:
  void Add(const Vector2d& vector_m, const Matrix2d& covariance_m2) {
    const Matrix2d weight =
        (covariance_m2 + kPoseSigma_m * kPoseSigma_m * Matrix2d::Identity()).inverse();
    sum_ += vector_m.dot(weight * vector_m);
    weights_ += weight.trace();
  }
  void Add(const WeightedRms& other) {
    sum_ += other.sum_;
    weights_ += other.weights_;
  }
  double Value() const { return std::sqrt(2 * ComputeShare(sum_, weights_)); }

 private:
  double sum_ = 0, weights_ = 0;
};

// A line in space and the plane across it.
class FittedLine {
 public:
  // Through the ends of observations: their mean, and the direction that they have in common.
  explicit FittedLine(const Ends& ends) {
    Matrix3d directions = Matrix3d::Zero();
    double weights = 0;
    p_.setZero();
    for (size_t i = 0; i + 1 < ends.size(); i += 2) {
      const Vector3d seen = ends[i + 1].place.p_world - ends[i].place.p_world;
      const double weight = 1 / (1e-12 + ends[i].place.covariance_m2.trace() +
                                 ends[i + 1].place.covariance_m2.trace());
      directions += weight * seen * seen.transpose();
      p_ += weight * 0.5 * (ends[i].place.p_world + ends[i + 1].place.p_world);
      weights += weight;
    }
    p_ /= weights;
    SetDirection(Eigen::SelfAdjointEigenSolver<Matrix3d>(directions).eigenvectors().col(2));
  }

  Across MeasureAcross(const PlacedInWorld& place) const {
    const Vector3d offset = place.p_world - p_;
    return {across_.transpose() * offset, across_.transpose() * place.covariance_m2 * across_,
            direction_.dot(offset)};
  }

  // One step of least squares over place across (2) and direction (2), with Cauchy's loss where
  // loss_m is finite; false where they are not determined.
  bool Improve(const Ends& ends, double loss_m) {
    Matrix4d information = Matrix4d::Zero();
    Vector4d gradient = Vector4d::Zero();
    for (const End& end : ends) {
      const Across across = MeasureAcross(end.place);
      const double off = across.residual_m.norm() / loss_m;
      const Matrix2d weight =
          (across.covariance_m2 + kPoseSigma_m * kPoseSigma_m * Matrix2d::Identity()).inverse() /
          (1 + off * off);
      Eigen::Matrix<double, 2, 4> by;
      by << Matrix2d::Identity(), across.along_m * Matrix2d::Identity();
      information += by.transpose() * weight * by;
      gradient += by.transpose() * weight * across.residual_m;
    }
    const Eigen::SelfAdjointEigenSolver<Matrix4d> solver(information);
    if (!(solver.eigenvalues()[0] > 1e-9 * solver.eigenvalues()[3])) return false;
    covariance_ = information.inverse();
    const Vector4d step = covariance_ * gradient;
    p_ += across_ * step.head<2>();
    SetDirection(direction_ + across_ * step.tail<2>());
    return true;
  }

  FittedEdge Result(const Ends& ends) const {
    double from_m = HUGE_VAL, to_m = -HUGE_VAL;
    for (const End& end : ends) {
      const double along_m = direction_.dot(end.place.p_world - p_);
      from_m = std::min(from_m, along_m);
      to_m = std::max(to_m, along_m);
    }
    FittedEdge line;
    line.p_world = p_ + 0.5 * (from_m + to_m) * direction_;
    line.direction_world = direction_;
    line.length_m = to_m - from_m;
    const Matrix2d turn = covariance_.bottomRightCorner<2, 2>();
    line.direction_sigma_rad =
        std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix2d>(turn).eigenvalues()[1]);
    line.observations = static_cast<int>(ends.size() / 2);
    return line;
  }

 private:
  void SetDirection(const Vector3d& direction) {
    direction_ = direction.normalized();
    across_.col(0) = direction_.unitOrthogonal();
    across_.col(1) = direction_.cross(across_.col(0));
  }

  Vector3d p_, direction_;
  Eigen::Matrix<double, 3, 2> across_;
  Matrix4d covariance_ = Matrix4d::Zero();
};

std::optional<FittedLine> Fit(const Ends& ends, double loss_m = HUGE_VAL) {
  if (ends.size() < 2 * kMinObservations) return std::nullopt;
  FittedLine line(ends);
  for (int i = 0; i < kIterations; ++i) {
    if (!line.Improve(ends, loss_m)) return std::nullopt;
  }
  return line;
}

// The ends of each edge in the world of a trajectory.
std::map<int64_t, Ends> EndsByEdge(const std::vector<EdgeObservation>& observations,
                                   const Trajectory& trajectory, int64_t* without_pose) {
  std::map<int64_t, Ends> edges;
  for (const EdgeObservation& observation : observations) {
    const std::optional<RigidTransform> pose = PoseAt(trajectory, observation.stamp_ns);
    if (!pose) {
      ++*without_pose;
      continue;
    }
    for (const Placed& end : observation.ends) {
      edges[observation.edge].push_back({observation.stamp_ns, InWorld(end, *pose)});
    }
  }
  return edges;
}

// Sums over pairs of observations of one edge, by the time between them.
class GapsByTime {
 public:
  void Add(const Ends& ends, const FittedLine& line) {
    std::vector<Across> across;
    for (const End& end : ends) across.push_back(line.MeasureAcross(end.place));
    for (size_t i = 0; i < ends.size(); i += 2) {
      for (size_t j = i + 2; j < ends.size(); j += 2) AddPair(ends, across, i, j);
    }
  }

  std::vector<TimeGap> Result() const {
    std::vector<TimeGap> gaps;
    for (size_t k = 0; k < kTimes_s.size(); ++k) {
      const double to_s = k + 1 < kTimes_s.size() ? kTimes_s[k + 1] : HUGE_VAL;
      gaps.push_back({kTimes_s[k], to_s, pairs_[k], sums_[k].Value()});
    }
    return gaps;
  }

 private:
  // The middles of two observations.
  void AddPair(const Ends& ends, const std::vector<Across>& across, size_t i, size_t j) {
    const double time_s = std::abs(ToSeconds(ends[j].stamp_ns - ends[i].stamp_ns));
    const auto above = std::upper_bound(kTimes_s.begin(), kTimes_s.end(), time_s);
    if (above == kTimes_s.begin()) return;
    const auto k = static_cast<size_t>(above - kTimes_s.begin() - 1);
    const auto middle = [&](size_t at) {
      return Vector2d(0.5 * (across[at].residual_m + across[at + 1].residual_m));
    };
    Matrix2d covariance_m2 = Matrix2d::Zero();
    for (const size_t at : {i, i + 1, j, j + 1}) {
      covariance_m2 += 0.25 * across[at].covariance_m2;
    }
    sums_[k].Add(middle(i) - middle(j), covariance_m2);
    ++pairs_[k];
  }

  std::array<int64_t, kTimes_s.size()> pairs_{};
  std::array<WeightedRms, kTimes_s.size()> sums_{};
};

WeightedRms MeasureThickness(const Ends& ends, const FittedLine& line) {
  WeightedRms thickness;
  for (const End& end : ends) {
    const Across across = line.MeasureAcross(end.place);
    thickness.Add(across.residual_m, across.covariance_m2);
  }
  return thickness;
}

bool IsFar(const End& end, const FittedLine& line) {
  const Across across = line.MeasureAcross(end.place);
  const Matrix2d covariance_m2 =
      across.covariance_m2 + kOtherThing_m * kOtherThing_m * Matrix2d::Identity();
  return across.residual_m.dot(covariance_m2.inverse() * across.residual_m) >
         kMostSigmasOff * kMostSigmasOff;
}

}  // namespace

EdgeStraightness RetriangulateEdges(const std::vector<EdgeObservation>& observations,
                                    const Trajectory& trajectory, const Progress& progress) {
  EdgeStraightness result;
  WeightedRms thickness;
  GapsByTime gaps;
  const auto all = EndsByEdge(observations, trajectory, &result.without_pose);
  double done = 0;
  for (const auto& [edge, ends] : all) {
    progress.ReportOrStop(done++ / static_cast<double>(all.size()));
    const std::optional<FittedLine> line = Fit(ends);
    if (!line) continue;
    const WeightedRms own = MeasureThickness(ends, *line);
    thickness.Add(own);
    gaps.Add(ends, *line);
    result.lines.push_back(line->Result(ends));
    result.lines.back().edge = edge;
    result.lines.back().thickness_m = own.Value();
    result.observations += result.lines.back().observations;
  }
  result.edges = static_cast<int64_t>(result.lines.size());
  result.thickness_m = thickness.Value();
  result.gaps = gaps.Result();
  return result;
}

std::vector<EdgeObservation> OfOneEdge(const std::vector<EdgeObservation>& observations,
                                       const Trajectory& trajectory) {
  int64_t without_pose = 0;
  std::map<int64_t, FittedLine> lines;
  for (const auto& [edge, ends] : EndsByEdge(observations, trajectory, &without_pose)) {
    if (const auto line = Fit(ends, kOtherThing_m)) lines.emplace(edge, *line);
  }
  std::vector<EdgeObservation> kept;
  for (const EdgeObservation& observation : observations) {
    const auto line = lines.find(observation.edge);
    const std::optional<RigidTransform> pose = PoseAt(trajectory, observation.stamp_ns);
    if (line == lines.end() || !pose) continue;
    const bool far =
        std::any_of(observation.ends.begin(), observation.ends.end(), [&](const Placed& end) {
          return IsFar({observation.stamp_ns, InWorld(end, *pose)}, line->second);
        });
    if (!far) kept.push_back(observation);
  }
  return kept;
}

double ThicknessBeyond_m(double thickness_m, double with_true_poses_m) {
  const double squares = thickness_m * thickness_m - with_true_poses_m * with_true_poses_m;
  return std::isnan(squares) ? kNoFigure : std::sqrt(std::max(0.0, squares));
}

}  // namespace slcmap::evaluation
