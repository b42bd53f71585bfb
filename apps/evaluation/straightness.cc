#include "apps/evaluation/straightness.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMinNeighbours = 8;    // within it, the point included
constexpr int kMaxPoints = 20000;    // whose neighbourhoods are looked at, evenly over the cloud
constexpr int kMaxNeighbours = 400;  // of one point, evenly over them
// A neighbourhood is of a plane where its least variance is below this share of the next.
constexpr double kMaxFlatness = 0.1;
// A line's direction counts where it is known so well and the line is so long.
constexpr double kMaxDirectionSigma_rad = 0.01;
constexpr double kMinLine_m = 0.3;
constexpr double kMaxFlatSigma_m = 0.02;  // of the points whose flatness is measured
constexpr double kRadius_m = 0.3;         // of the neighbourhood of a point of a run
constexpr double kMaxNormal_deg = 10;     // of a normal from an axis, for MOM

constexpr double kLeastVariance_m2 = 1e-12;  // of a micrometre: keeps the entropy finite

// The variances of a neighbourhood along its principal directions, ascending.
struct Neighbourhood {
  Vector3d variances_m2;
  Vector3d normal;
};

std::vector<Eigen::Vector3f> PlacesFromFirst(const std::vector<Vector3d>& points) {
  std::vector<Eigen::Vector3f> places;
  for (const Vector3d& p : points) places.push_back((p - points.front()).cast<float>());
  return places;
}

class Neighbourhoods {
 public:
  Neighbourhoods(const std::vector<Vector3d>& points, double radius_m)
      : points_(points), radius_m_(radius_m), places_(PlacesFromFirst(points)), tree_(places_) {}

  std::optional<Neighbourhood> Around(size_t point) {
    tree_.FindWithin(places_[point], radius_m_, &near_);
    const std::vector<int>& found = near_.items;
    if (static_cast<int>(found.size()) < kMinNeighbours) return std::nullopt;
    const size_t step = (found.size() + kMaxNeighbours - 1) / static_cast<size_t>(kMaxNeighbours);
    Vector3d mean = Vector3d::Zero();
    Matrix3d products = Matrix3d::Zero();
    double count = 0;
    for (size_t i = 0; i < found.size(); i += step) {
      const Vector3d offset = points_[static_cast<size_t>(found[i])] - points_[point];
      mean += offset;
      products += offset * offset.transpose();
      ++count;
    }
    mean /= count;
    // Unbiased, so that thinning a cloud does not make it flatter.
    const Matrix3d covariance = (products - count * mean * mean.transpose()) / (count - 1);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance);
    return Neighbourhood{solver.eigenvalues().cwiseMax(kLeastVariance_m2),
                         solver.eigenvectors().col(0)};
  }

 private:
  const std::vector<Vector3d>& points_;
  const double radius_m_;
  const std::vector<Eigen::Vector3f> places_;
  const PointTree tree_;
  PointTree::Found near_;
};

double Entropy(const Neighbourhood& n) {
  const double two_pi_e = 2 * std::numbers::pi * std::numbers::e;
  return 0.5 * (3 * std::log(two_pi_e) + n.variances_m2.array().log().sum());
}

// Over the neighbourhoods whose normals are along three directions at right angles.
void MeasureOrthogonalPlanes(const std::vector<Neighbourhood>& all, FlatnessMetrics* metrics) {
  std::vector<WeightedDirection> normals;
  std::vector<double> variances_m2;
  for (const Neighbourhood& n : all) {
    if (n.variances_m2[0] > kMaxFlatness * n.variances_m2[1]) continue;
    normals.push_back({n.normal, 1});
    variances_m2.push_back(n.variances_m2[0]);
  }
  const auto directions = MeasureDirections(normals, kMaxNormal_deg, 0);
  if (!directions) return;
  double sum = 0;
  for (size_t i = 0; i < normals.size(); ++i) {
    if (!FindAxis(directions->axes, normals[i].direction, kMaxNormal_deg)) continue;
    sum += variances_m2[i];
    ++metrics->on_planes;
  }
  if (metrics->on_planes > 0) metrics->mom_m2 = sum / static_cast<double>(metrics->on_planes);
}

}  // namespace

std::optional<FlatnessMetrics> MeasureFlatness(const std::vector<Vector3d>& points, double radius_m,
                                               const Progress& progress) {
  if (points.empty()) return std::nullopt;
  Neighbourhoods neighbourhoods(points, radius_m);
  std::vector<Neighbourhood> all;
  const size_t step = (points.size() + kMaxPoints - 1) / static_cast<size_t>(kMaxPoints);
  for (size_t i = 0; i < points.size(); i += step) {
    if (i % 100 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(points.size()));
    }
    if (const auto neighbourhood = neighbourhoods.Around(i)) all.push_back(*neighbourhood);
  }
  if (all.empty()) return std::nullopt;
  FlatnessMetrics metrics;
  metrics.points = static_cast<int64_t>(points.size());
  metrics.looked_at = static_cast<int64_t>(all.size());
  for (const Neighbourhood& n : all) {
    metrics.mpv_m2 += n.variances_m2[0] / static_cast<double>(all.size());
    metrics.mme += Entropy(n) / static_cast<double>(all.size());
  }
  MeasureOrthogonalPlanes(all, &metrics);
  return metrics;
}

namespace {

std::vector<WeightedDirection> CollectDirections(const EdgeStraightness& edges) {
  std::vector<WeightedDirection> directions;
  for (const FittedEdge& line : edges.lines) {
    if (line.length_m < kMinLine_m) continue;
    if (line.direction_sigma_rad > kMaxDirectionSigma_rad) continue;
    directions.push_back({line.direction_world, line.length_m});
  }
  return directions;
}

std::vector<Vector3d> FlatPoints(const std::vector<PointOfPair>& points,
                                 const Trajectory& trajectory, double max_sigma_m) {
  std::vector<Vector3d> placed;
  for (const PointOfPair& point : points) {
    if (point.place.covariance_m2.trace() > max_sigma_m * max_sigma_m) continue;
    const auto pose = PoseAt(trajectory, point.stamp_ns);
    if (pose) placed.push_back(*pose * point.place.p_imu);
  }
  return placed;
}

}  // namespace

StraightnessReference MakeReference(const OdometryRun& run, const Trajectory& final_poses,
                                    const std::vector<const Trajectory*>& trajectories,
                                    const KnownTruth& truth, const Progress& progress) {
  StraightnessReference reference;
  reference.true_edges = !truth.trajectory.empty() && !truth.edges.whole.empty();
  const Trajectory& poses = truth.trajectory.empty() ? final_poses : truth.trajectory;
  std::vector<const Trajectory*> all = trajectories;
  all.push_back(&poses);
  reference.observations = SeenByAll(ObservationsOfRun(run, progress.Part(0, 0.2)), all);
  progress.ReportOrStop(0.3);
  std::vector<EdgeObservation>& edges = reference.observations.edges;
  edges = reference.true_edges ? OnTrueEdges(edges, poses, truth.edges) : OfOneEdge(edges, poses);
  progress.ReportOrStop(1);
  return reference;
}

Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Progress& progress) {
  const ReferenceObservations& observations = reference.observations;
  Straightness result;
  result.edges = RetriangulateEdges(observations.edges, trajectory, progress.Part(0, 0.5));
  result.directions = MeasureDirections(CollectDirections(result.edges));
  result.flatness = MeasureFlatness(FlatPoints(observations.points, trajectory, kMaxFlatSigma_m),
                                    kRadius_m, progress.Part(0.5, 1));
  return result;
}

}  // namespace slcmap::evaluation
