#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "apps/evaluation/straightness.h"
#include "data/io/yaml.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSigma_px = 0.1;  // of an observed edge or point, across it
// of a place, where that is largest: what is known worse is left out
constexpr double kPlacementMaxSigma_m = 0.05;
constexpr double kMaxDepth_m = 10;
// An edge's observation belongs to a true edge when both its ends are nearer to it than this,
// counted in standard deviations (of the place, and of edge_sigma_m beside it) and in metres.
constexpr double kMaxSigmas = 3;
constexpr double kEdgeSigma_m = 0.005;
constexpr double kMaxEdgeDistance_m = 0.1;
// between them, where the observation is long enough to tell
constexpr double kPlacementMaxAngle_deg = 15;

constexpr double kLeastDepth_m = 0.2;
constexpr double kTellingLength = 10;   // of an observation, in standard deviations of its ends
constexpr double kBeyondEnds_m = 0.05;  // of a true edge
constexpr double kClearlyWorse = 6;     // of another edge's chi2, by which the nearest one is told
constexpr double kSameLine_m = 0.003;   // pieces of one edge go on in each other

Vector3d Ray(const Vector2d& on_plane) { return on_plane.homogeneous(); }

LineSegment Moved(LineSegment segment, int end, double distance) {
  const Vector2d along = (segment.end - segment.start).normalized();
  (end == 0 ? segment.start : segment.end) += distance * Vector2d(-along.y(), along.x());
  return segment;
}

// Places what a stereo pair shows, on the planes z = 1 of its rectified cameras.
class PairGeometry {
 public:
  PairGeometry(const Rig& rig)
      : T_imu_left_(rig.T_imu_camera[0]),
        T_left_right_(rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]),
        sigma_(kSigma_px / rig.cameras[0].fx_px) {}

  // Where the ray of an end of the left segment meets the plane of the right one.
  std::optional<Placed> PlaceEnd(const LineSegment& left, const LineSegment& right, int end) const {
    const auto meet = [&](const LineSegment& l, const LineSegment& r) {
      return Meet(Ray(end == 0 ? l.start : l.end), r);
    };
    const std::optional<Vector3d> p = meet(left, right);
    if (!p) return std::nullopt;
    return Known(*p, {meet(Moved(left, end, sigma_), right), meet(left, Moved(right, 0, sigma_)),
                      meet(left, Moved(right, 1, sigma_))});
  }

  // The same of a point: the plane is that of the right camera's column.
  std::optional<Placed> PlacePoint(const Vector2d& left, const Vector2d& right) const {
    const auto meet = [&](const Vector2d& l, const Vector2d& r) {
      return Meet(Ray(l), {r - Vector2d::UnitY(), r + Vector2d::UnitY()});
    };
    const std::optional<Vector3d> p = meet(left, right);
    if (!p) return std::nullopt;
    return Known(*p, {meet(left + sigma_ * Vector2d::UnitX(), right),
                      meet(left + sigma_ * Vector2d::UnitY(), right),
                      meet(left, right + sigma_ * Vector2d::UnitX())});
  }

 private:
  // In the left camera.
  std::optional<Vector3d> Meet(const Vector3d& left_ray, const LineSegment& right) const {
    const Vector3d normal = T_left_right_.rotation * Ray(right.start).cross(Ray(right.end));
    const double depth_m = normal.dot(T_left_right_.translation) / normal.dot(left_ray);
    if (!(depth_m > kLeastDepth_m && depth_m < kMaxDepth_m)) return std::nullopt;
    return depth_m * left_ray;
  }

  // A place with the spread that its displacements show; nothing where that is too large.
  std::optional<Placed> Known(const Vector3d& p_left,
                              const std::array<std::optional<Vector3d>, 3>& displaced) const {
    Placed place{T_imu_left_ * p_left, Matrix3d::Zero()};
    for (const std::optional<Vector3d>& other : displaced) {
      if (!other) return std::nullopt;
      const Vector3d change = T_imu_left_.rotation * (*other - p_left);
      place.covariance_m2 += change * change.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> spread(place.covariance_m2,
                                                         Eigen::EigenvaluesOnly);
    if (!(std::sqrt(spread.eigenvalues()[2]) <= kPlacementMaxSigma_m)) return std::nullopt;
    return place;
  }

  const RigidTransform T_imu_left_, T_left_right_;
  const double sigma_;
};

std::optional<EdgeObservation> PlaceLine(const PairGeometry& geometry, const Rig& rig,
                                         const LineObservation& line, int64_t stamp_ns) {
  if (!line.right_px || line.camera != 0) return std::nullopt;  // of the first pair
  const LineSegment left = PlaneFromPixel(rig.cameras[0], line.left_px);
  const LineSegment right = PlaneFromPixel(rig.cameras[1], *line.right_px);
  const std::optional<Placed> start = geometry.PlaceEnd(left, right, 0);
  const std::optional<Placed> end = geometry.PlaceEnd(left, right, 1);
  if (!start || !end) return std::nullopt;
  return EdgeObservation{line.id, stamp_ns, {*start, *end}};
}

// Squared distance of a place from the line of an edge in standard deviations; infinite where it is
// too far in metres.
double EdgeChi2(const PlacedInWorld& place, const Vector3d& p, const Vector3d& direction) {
  const Matrix3d across = Matrix3d::Identity() - direction * direction.transpose();
  const Vector3d distance = across * (place.p_world - p);
  if (distance.squaredNorm() > kMaxEdgeDistance_m * kMaxEdgeDistance_m) return HUGE_VAL;
  // The direction itself counts for nothing: the distance has no part along it.
  const Matrix3d spread = place.covariance_m2 + kEdgeSigma_m * kEdgeSigma_m * Matrix3d::Identity();
  const Matrix3d across_spread = across * spread * across + direction * direction.transpose();
  return distance.dot(across_spread.inverse() * distance);
}

// Finds the true edge that an observation lies on.
class EdgeFinder {
 public:
  EdgeFinder(const TrueEdges& edges)
      : edges_(edges), least_cosine_(std::cos(kPlacementMaxAngle_deg * std::numbers::pi / 180)) {}

  // Its index in TrueEdges::whole; nothing where there is none, or several are as near.
  std::optional<size_t> Find(const std::array<PlacedInWorld, 2>& ends) const {
    std::optional<size_t> best;
    double best_chi2 = 2 * kMaxSigmas * kMaxSigmas, other_chi2 = HUGE_VAL;
    std::vector<std::pair<double, size_t>> near;
    for (size_t i = 0; i < edges_.whole.size(); ++i) {
      const double chi2 = Chi2(ends, edges_.whole[i]);
      if (chi2 < best_chi2 + kClearlyWorse) near.emplace_back(chi2, i);
      if (chi2 < best_chi2) best_chi2 = chi2, best = i;
    }
    if (!best) return best;
    for (const auto& [chi2, i] : near) {
      if (i != *best && !GoesOn(edges_.whole[i], edges_.whole[*best])) {
        other_chi2 = std::min(other_chi2, chi2);
      }
    }
    if (other_chi2 < best_chi2 + kClearlyWorse) return std::nullopt;
    return best;
  }

 private:
  // Summed over both ends; infinite where the edge is out of question.
  double Chi2(const std::array<PlacedInWorld, 2>& ends, const PlySegment& edge) const {
    const Vector3d whole = edge.end_world - edge.start_world;
    const double length_m = whole.norm();
    if (length_m < 1e-6) return HUGE_VAL;
    const Vector3d direction = whole / length_m;
    const Vector3d middle = 0.5 * (ends[0].p_world + ends[1].p_world) - edge.start_world;
    const double along_m = direction.dot(middle);
    if (along_m < -kBeyondEnds_m || along_m > length_m + kBeyondEnds_m) return HUGE_VAL;
    const double limit_m = kMaxEdgeDistance_m;
    if ((middle - along_m * direction).squaredNorm() > limit_m * limit_m) return HUGE_VAL;
    if (!IsAlong(ends, direction)) return HUGE_VAL;
    double chi2 = 0;
    for (const PlacedInWorld& end : ends) chi2 += EdgeChi2(end, edge.start_world, direction);
    return chi2;
  }

  bool IsAlong(const std::array<PlacedInWorld, 2>& ends, const Vector3d& direction) const {
    const Vector3d seen = ends[1].p_world - ends[0].p_world;
    const double sigma_m =
        std::sqrt(std::max(ends[0].covariance_m2.trace(), ends[1].covariance_m2.trace()));
    if (seen.norm() < kTellingLength * sigma_m) return true;
    return std::abs(seen.normalized().dot(direction)) > least_cosine_;
  }

  static bool GoesOn(const PlySegment& a, const PlySegment& b) {
    const Vector3d direction = (b.end_world - b.start_world).normalized();
    const auto distance_m = [&](const Vector3d& p) {
      return direction.cross(p - b.start_world).norm();
    };
    return distance_m(a.start_world) < kSameLine_m && distance_m(a.end_world) < kSameLine_m;
  }

  const TrueEdges& edges_;
  const double least_cosine_;
};

}  // namespace

PlacedInWorld InWorld(const Placed& place, const RigidTransform& T_world_imu) {
  const Matrix3d rotation = T_world_imu.rotation.toRotationMatrix();
  return {T_world_imu * place.p_imu, rotation * place.covariance_m2 * rotation.transpose()};
}

ReferenceObservations ObservationsOfRun(const OdometryRun& run, const Progress& progress) {
  const Rig& rig = run.rectified_rig;
  const PairGeometry geometry(rig);
  ReferenceObservations found;
  double done = 0;
  for (const Keyframe& keyframe : run.keyframes) {
    progress.ReportOrStop(done++ / static_cast<double>(run.keyframes.size()));
    for (const LineObservation& line : keyframe.lines) {
      const auto placed = PlaceLine(geometry, rig, line, keyframe.stamp_ns);
      placed ? found.edges.push_back(*placed) : void(++found.left_out);
    }
    for (const KeyframeObservation& point : keyframe.observations) {
      std::optional<Placed> place;
      if (point.right_px && point.camera == 0) {
        place = geometry.PlacePoint(PlaneFromPixel(rig.cameras[0], point.left_px),
                                    PlaneFromPixel(rig.cameras[1], *point.right_px));
      }
      place ? found.points.push_back({keyframe.stamp_ns, *place}) : void(++found.left_out);
    }
  }
  return found;
}

std::vector<EdgeObservation> OnTrueEdges(const std::vector<EdgeObservation>& observations,
                                         const Trajectory& truth, const TrueEdges& edges) {
  const EdgeFinder finder(edges);
  std::vector<EdgeObservation> found;
  for (const EdgeObservation& observation : observations) {
    const std::optional<RigidTransform> pose = PoseAt(truth, observation.stamp_ns);
    if (!pose) continue;
    const std::optional<size_t> edge =
        finder.Find({InWorld(observation.ends[0], *pose), InWorld(observation.ends[1], *pose)});
    if (!edge) continue;
    found.push_back(observation);
    found.back().edge = static_cast<int64_t>(*edge);
  }
  return found;
}

ReferenceObservations SeenByAll(const ReferenceObservations& observations,
                                const std::vector<const Trajectory*>& trajectories) {
  const auto lacks_pose = [&](const auto& observation) {
    return std::any_of(trajectories.begin(), trajectories.end(), [&](const Trajectory* t) {
      return !PoseAt(*t, observation.stamp_ns).has_value();
    });
  };
  ReferenceObservations seen = observations;
  std::erase_if(seen.edges, lacks_pose);
  std::erase_if(seen.points, lacks_pose);
  return seen;
}

}  // namespace slcmap::evaluation
