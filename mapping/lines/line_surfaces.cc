#include "mapping/lines/line_surfaces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/quantile.h"

namespace slcmap {
namespace {

constexpr double kStep_m = 0.1;     // along a line
constexpr double kAround_m = 0.15;  // up to which points count
constexpr double kBeside_m = 0.02;  // from a line on, points are at one of its sides
constexpr int kMinPoints = 4;       // that show a surface at one side
constexpr double kTolerance_m = 0.015, kSigmas = 2;  // of points from a plane
constexpr double kMaxOff_m = 0.03;                   // of a plane from a line that is on it
constexpr int kPlaneDirections = 36;                 // of planes that are tried
constexpr double kSameWay = 0.82;                    // cosine, of a plane's points' normals to its
constexpr double kMinAcross = 0.5;     // the same of normals to the plane across a line
constexpr double kMaxBend_rad = 0.35;  // between the normals at the two sides
constexpr double kMaxTilt_rad = 0.2;   // of their mean from the plane
// What stands on a surface at a line: points so far in front of it, and so near to the line.
constexpr double kMinStanding_m = 0.03, kMaxStanding_m = 0.12, kAtLine_m = 0.035;

// A point of a surface, across a line.
struct PointAcross {
  Eigen::Vector2d place;   // metres from the line
  Eigen::Vector2d normal;  // unit, towards the cameras
  double tolerance_m;      // from the plane that it is of
};

double Turn_rad(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::atan2(std::abs(a.x() * b.y() - a.y() * b.x()), a.dot(b));
}

// Of the points that look the way of a normal and lie near the line, where along it most are.
double PlaceAlong_m(const std::vector<PointAcross>& points, const Eigen::Vector2d& normal) {
  std::vector<double> places_m;
  for (const PointAcross& point : points) {
    const double off_m = normal.dot(point.place);
    if (normal.dot(point.normal) > kSameWay && std::abs(off_m) < kMaxOff_m + point.tolerance_m) {
      places_m.push_back(off_m);
    }
  }
  if (places_m.empty()) return 2 * kMaxOff_m;
  return Quantile(std::move(places_m), 0.5);
}

// A plane across a line, and the points on it at the line's two sides.
struct PlaneBeside {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double off_m = 0;
  int left = 0, right = 0;
  Eigen::Vector2d left_normals = Eigen::Vector2d::Zero(), right_normals = left_normals;

  int Least() const { return std::min(left, right); }
};

PlaneBeside PlaneWith(const Eigen::Vector2d& normal, const std::vector<PointAcross>& points) {
  PlaneBeside plane;
  plane.normal = normal;
  plane.off_m = PlaceAlong_m(points, normal);
  if (std::abs(plane.off_m) > kMaxOff_m) return plane;
  const Eigen::Vector2d along(-normal.y(), normal.x());
  for (const PointAcross& point : points) {
    const double beside_m = along.dot(point.place);
    if (std::abs(normal.dot(point.place) - plane.off_m) > point.tolerance_m) continue;
    if (normal.dot(point.normal) < kSameWay || std::abs(beside_m) < kBeside_m) continue;
    ++(beside_m < 0 ? plane.left : plane.right);
    (beside_m < 0 ? plane.left_normals : plane.right_normals) += point.normal;
  }
  // A plane leant from one level of a step to the other.
  if (Turn_rad(plane.left_normals + plane.right_normals, normal) > kMaxTilt_rad) {
    plane.left = plane.right = 0;
  }
  return plane;
}

// The plane that the line may lie on, with most points at the side of which there are fewer: what
// is beyond the surface that cameras see, as the back of a thin leaf, has other normals.
PlaneBeside BestPlane(const std::vector<PointAcross>& points) {
  PlaneBeside best;
  for (int i = 0; i < kPlaneDirections; ++i) {
    const double angle = 2 * M_PI * i / kPlaneDirections;
    const PlaneBeside plane = PlaneWith({std::cos(angle), std::sin(angle)}, points);
    const bool is_better = plane.Least() != best.Least()
                               ? plane.Least() > best.Least()
                               : plane.left + plane.right > best.left + best.right;
    if (is_better) best = plane;
  }
  return best;
}

// Whether a surface goes on flat at both sides of the line, and nothing stands on it there.
bool IsFlat(const std::vector<PointAcross>& points) {
  const PlaneBeside plane = BestPlane(points);
  if (plane.Least() < kMinPoints) return false;
  if (Turn_rad(plane.left_normals, plane.right_normals) > kMaxBend_rad) return false;
  const Eigen::Vector2d along(-plane.normal.y(), plane.normal.x());
  const auto standing = std::count_if(points.begin(), points.end(), [&](const PointAcross& point) {
    const double in_front_m = plane.normal.dot(point.place) - plane.off_m;
    return in_front_m > kMinStanding_m && in_front_m < kMaxStanding_m &&
           std::abs(along.dot(point.place)) < kAtLine_m;
  });
  return standing < kMinPoints;
}

}  // namespace

LineSurfaces::LineSurfaces(const std::vector<DensePoint>& cloud) : cloud_(cloud), index_(cloud) {}

LineSurfaces::Surface LineSurfaces::At(const Eigen::Vector3d& p_world,
                                       const Eigen::Vector3d& direction_world) const {
  std::vector<int> found;
  index_.Find(p_world, kAround_m, &found);
  const Eigen::Vector3d first = direction_world.unitOrthogonal();
  const Eigen::Vector3d second = direction_world.cross(first);
  std::vector<PointAcross> points;
  for (const int i : found) {
    const DensePoint& point = cloud_[i];
    const Eigen::Vector3d offset = point.p_world - p_world;
    const Eigen::Vector2d normal(first.dot(point.normal_world), second.dot(point.normal_world));
    if (normal.norm() < kMinAcross) continue;  // of what the line ends at
    points.push_back({{first.dot(offset), second.dot(offset)},
                      normal.normalized(),
                      kTolerance_m + kSigmas * point.sigma_m});
  }
  if (points.size() < 2 * kMinPoints) return Surface::kUnknown;
  return IsFlat(points) ? Surface::kFlat : Surface::kRelief;
}

SurfacesBeside LineSurfaces::Beside(const PointAndDirection& line,
                                    const std::vector<Stretch>& intervals) const {
  SurfacesBeside beside;
  for (const Stretch& interval : intervals) {
    const double length_m = interval.length_m();
    const double count = std::max(1.0, std::round(length_m / kStep_m));
    for (double i = 0.5; i < count; ++i) {
      const double along_m = interval.from_m + i / count * length_m;
      const Surface surface =
          At(line.point_world + along_m * line.direction_world, line.direction_world);
      double& part_m = surface == Surface::kFlat     ? beside.flat_m
                       : surface == Surface::kRelief ? beside.relief_m
                                                     : beside.unknown_m;
      part_m += length_m / count;
    }
  }
  return beside;
}

}  // namespace slcmap
