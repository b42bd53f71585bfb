#include "apps/evaluation/straightness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "apps/evaluation/edge_straightness.h"
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
constexpr double kThickness_m = 0.04;       // a point of a wall is at most so far from its middle
constexpr double kFinderMaxSigma_m = 0.03;  // of a point across it
constexpr double kFinderMaxGap_m = 1.5;     // along it between points
constexpr double kMinLength_m = 2;
constexpr double kMinHeight_m = 0.8;
constexpr int kMinPoints = 60;
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

constexpr double kLevel = 0.26;        // most of the vertical in a level axis: 15 degrees
constexpr double kBin_m = 0.01;        // of the search for offsets
constexpr double kInFront_m = 0.1;     // of a wall the camera is
constexpr double kFloorStrip_m = 0.5;  // of the length of a wall, each with points in it
constexpr double kFilled = 0.6;        // of these strips

struct Candidate {
  size_t index = 0;  // of the point
  double offset_m = 0, along_m = 0, up_m = 0;
};

// The points that a camera before them saw across a direction.
std::vector<Candidate> Before(const std::vector<PointOfPair>& points, const Trajectory& trajectory,
                              const Vector3d& normal, double max_sigma_m) {
  const Vector3d along = Vector3d::UnitZ().cross(normal).normalized();
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto pose = PoseAt(trajectory, points[i].stamp_ns);
    if (!pose) continue;
    const PlacedInWorld placed = InWorld(points[i].place, *pose);
    const Vector3d& p = placed.p_world;
    if (normal.dot(pose->translation - p) < kInFront_m) continue;
    if (normal.dot(placed.covariance_m2 * normal) > max_sigma_m * max_sigma_m) continue;
    candidates.push_back({i, normal.dot(p), along.dot(p), p.z()});
  }
  return candidates;
}

// The offset around which most points are; they are sorted by it.
double FullestOffset_m(const std::vector<Candidate>& sorted, double thickness_m, size_t* count) {
  double fullest_m = 0;
  *count = 0;
  size_t from = 0, to = 0;
  const double last_m = sorted.back().offset_m;
  for (double at_m = sorted.front().offset_m; at_m <= last_m; at_m += kBin_m) {
    while (sorted[from].offset_m < at_m - thickness_m) ++from;
    while (to < sorted.size() && sorted[to].offset_m <= at_m + thickness_m) ++to;
    if (to - from > *count) *count = to - from, fullest_m = at_m;
  }
  return fullest_m;
}

bool IsWall(const std::vector<Candidate>& piece) {
  if (static_cast<int>(piece.size()) < kMinPoints) return false;
  const double length_m = piece.back().along_m - piece.front().along_m;
  if (length_m < kMinLength_m) return false;
  const auto [low, high] = std::minmax_element(
      piece.begin(), piece.end(), [](const auto& a, const auto& b) { return a.up_m < b.up_m; });
  if (high->up_m - low->up_m < kMinHeight_m) return false;
  std::map<int64_t, int> strips;
  for (const Candidate& c : piece) ++strips[std::lround(c.along_m / kFloorStrip_m)];
  return static_cast<double>(strips.size()) > kFilled * length_m / kFloorStrip_m;
}

// Cuts what shares an offset where nothing is along it.
void AddPieces(std::vector<Candidate> layer, std::vector<FoundWall>* walls) {
  std::sort(layer.begin(), layer.end(),
            [](const auto& a, const auto& b) { return a.along_m < b.along_m; });
  std::vector<Candidate> piece;
  for (size_t i = 0; i <= layer.size(); ++i) {
    const bool ends = i == layer.size() ||
                      (!piece.empty() && layer[i].along_m > piece.back().along_m + kFinderMaxGap_m);
    if (ends && IsWall(piece)) {
      FoundWall wall{static_cast<int64_t>(walls->size()), {}};
      for (const Candidate& c : piece) wall.points.push_back(c.index);
      walls->push_back(std::move(wall));
    }
    if (ends) piece.clear();
    if (i < layer.size()) piece.push_back(layer[i]);
  }
}

void FindAcross(std::vector<Candidate> candidates, std::vector<FoundWall>* walls) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.offset_m < b.offset_m; });
  while (static_cast<int>(candidates.size()) >= kMinPoints) {
    size_t count = 0;
    const double offset_m = FullestOffset_m(candidates, kThickness_m, &count);
    if (static_cast<int>(count) < kMinPoints) return;
    const auto in_layer = [&](const Candidate& c) {
      return std::abs(c.offset_m - offset_m) <= kThickness_m;
    };
    std::vector<Candidate> layer;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(layer), in_layer);
    std::erase_if(candidates, in_layer);
    AddPieces(std::move(layer), walls);
  }
}

}  // namespace

std::vector<FoundWall> FindWalls(const std::vector<PointOfPair>& points,
                                 const Trajectory& trajectory, const Eigen::Matrix3d& axes) {
  std::vector<FoundWall> walls;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(axes(2, axis)) > kLevel) continue;
    for (const double side : {1.0, -1.0}) {
      const Vector3d normal = side * Vector3d(axes(0, axis), axes(1, axis), 0).normalized();
      FindAcross(Before(points, trajectory, normal, kFinderMaxSigma_m), &walls);
    }
  }
  return walls;
}

std::vector<SurveyedPoints> PlaceWalls(const std::vector<FoundWall>& walls,
                                       const std::vector<PointOfPair>& points,
                                       const Trajectory& trajectory) {
  std::vector<SurveyedPoints> placed;
  for (const FoundWall& wall : walls) {
    SurveyedPoints surveyed{wall.wall, Vector3d::Zero(), {}};
    for (const size_t index : wall.points) {
      const auto pose = PoseAt(trajectory, points[index].stamp_ns);
      if (!pose) continue;
      surveyed.points.push_back(InWorld(points[index].place, *pose));
      surveyed.seen_from_world += pose->translation;
    }
    if (surveyed.points.empty()) continue;
    surveyed.seen_from_world /= static_cast<double>(surveyed.points.size());
    placed.push_back(std::move(surveyed));
  }
  return placed;
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
  reference.true_poses = !truth.trajectory.empty();
  reference.true_edges = reference.true_poses && !truth.edges.whole.empty();
  const Trajectory& poses = reference.true_poses ? truth.trajectory : final_poses;
  std::vector<const Trajectory*> all = trajectories;
  all.push_back(&poses);
  reference.observations = SeenByAll(ObservationsOfRun(run, progress.Part(0, 0.2)), all);
  progress.ReportOrStop(0.3);
  std::vector<EdgeObservation>& edges = reference.observations.edges;
  edges = reference.true_edges ? OnTrueEdges(edges, poses, truth.edges) : OfOneEdge(edges, poses);
  progress.ReportOrStop(0.6);
  const auto directions = MeasureDirections(
      CollectDirections(RetriangulateEdges(edges, poses, progress.Part(0.6, 0.9))));
  progress.ReportOrStop(0.9);
  if (directions) {
    reference.walls = FindWalls(reference.observations.points, poses, directions->axes);
  }
  return reference;
}

Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Trajectory& truth,
                                 const Progress& progress) {
  const ReferenceObservations& observations = reference.observations;
  Straightness result;
  result.edges = RetriangulateEdges(observations.edges, trajectory, progress.Part(0, 0.4));
  result.directions = MeasureDirections(CollectDirections(result.edges));
  result.flatness = MeasureFlatness(FlatPoints(observations.points, trajectory, kMaxFlatSigma_m),
                                    kRadius_m, progress.Part(0.4, 0.8));
  progress.ReportOrStop(0.8);
  const std::vector<SurveyedPoints> walls =
      PlaceWalls(reference.walls, observations.points, trajectory);
  result.survey = SurveyWalls(walls, Vector3d::UnitZ());
  progress.ReportOrStop(0.9);
  if (!truth.empty()) {
    const std::vector<SurveyedPoints> true_walls =
        PlaceWalls(reference.walls, observations.points, truth);
    result.added = SurveyWalls(BendsAdded(walls, true_walls, Vector3d::UnitZ()), Vector3d::UnitZ());
  }
  return result;
}

}  // namespace slcmap::evaluation
