#include "mapping/lines/line_store.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/core/math.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kAxisMaxTilt_rad = 0.07;  // of the building's vertical from the world's z
constexpr double kWindow_rad = 0.02;       // headings within it of each other are one
constexpr double kMinLength_m = 5;         // of lines that follow an axis
constexpr double kAxisMinShare = 0.2;      // of the length along the heading that most follow
// Times what would follow a heading if the level lines had any: in a furnished room each has
// some.
constexpr double kMinOverChance = 2.5;
constexpr double kMinApart_rad = 0.05;  // between headings
constexpr double kSigma_rad = 0.003;    // of lines from their axis

constexpr double kQuarter_rad = M_PI / 2;
// Times what a run has learned: it has one standard deviation for the lines of all axes, which the
// many that hardly deviate make small. (AdjustmentOptions::deviation_scale is more, since poses
// hang on all lines at once.)
constexpr double kDeviationScale = 1.4;

double Weight(const DirectedLine& line) {
  return line.length_m / (1 + std::pow(line.sigma_rad / kWindow_rad, 2));
}

Eigen::Vector3d FindVertical(const std::vector<DirectedLine>& lines) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double length_m = 0;
  for (const DirectedLine& line : lines) {
    const double sense = line.direction_world.z() < 0 ? -1 : 1;
    if (sense * line.direction_world.z() < std::cos(kAxisMaxTilt_rad)) continue;
    sum += Weight(line) * sense * line.direction_world;
    length_m += line.length_m;
  }
  return length_m < kMinLength_m ? up : Eigen::Vector3d(sum.normalized());
}

// The heading of a level line in [0, pi / 2), and how much it counts.
struct Heading {
  double angle_rad = 0, weight = 0, length_m = 0;
};

double Apart(double a_rad, double b_rad) {
  const double apart = std::abs(std::remainder(a_rad - b_rad, kQuarter_rad));
  return apart;
}

std::vector<Heading> LevelHeadings(const std::vector<DirectedLine>& lines) {
  std::vector<Heading> headings;
  for (const DirectedLine& line : lines) {
    if (std::abs(line.direction_world.z()) > std::sin(kAxisMaxTilt_rad)) continue;
    const double angle = std::atan2(line.direction_world.y(), line.direction_world.x());
    headings.push_back({std::fmod(angle + 2 * M_PI, kQuarter_rad), Weight(line), line.length_m});
  }
  return headings;
}

// What lines within the window around an angle sum up to; the angle is their mean.
Heading SumAround(const std::vector<Heading>& headings, double angle_rad, double window_rad) {
  Heading sum;
  double offset = 0;
  for (const Heading& heading : headings) {
    if (Apart(heading.angle_rad, angle_rad) > window_rad) continue;
    sum.weight += heading.weight;
    sum.length_m += heading.length_m;
    offset += heading.weight * std::remainder(heading.angle_rad - angle_rad, kQuarter_rad);
  }
  sum.angle_rad = angle_rad + (sum.weight > 0 ? offset / sum.weight : 0);
  return sum;
}

// What lines within half the window to each side of an angle would sum up to if each had any.
double WeightByChance(const std::vector<Heading>& headings, double window_rad) {
  double sum = 0;
  for (const Heading& heading : headings) sum += heading.weight;
  return sum * window_rad / kQuarter_rad;
}

Heading StrongestHeading(const std::vector<Heading>& headings, double window_rad) {
  Heading strongest;
  for (double angle = 0; angle < kQuarter_rad; angle += window_rad / 2) {
    const Heading sum = SumAround(headings, angle, window_rad);
    if (sum.weight > strongest.weight) strongest = sum;
  }
  for (int i = 0; i < 3; ++i) strongest = SumAround(headings, strongest.angle_rad, window_rad / 2);
  return strongest;
}

}  // namespace

std::vector<BuildingAxis> FindAxes(const std::vector<DirectedLine>& lines) {
  std::vector<BuildingAxis> axes = {{LineAxis::kVertical, -1, -1, FindVertical(lines), kSigma_rad}};
  std::vector<Heading> headings = LevelHeadings(lines);
  const double least = kMinOverChance * WeightByChance(headings, kWindow_rad);
  double most = 0;
  for (int world = 0;; ++world) {
    const Heading heading = StrongestHeading(headings, kWindow_rad);
    if (heading.length_m < kMinLength_m) break;
    if (heading.weight < std::max(least, kAxisMinShare * most)) break;
    most = std::max(most, heading.weight);
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back({axis, world, -1, AxisDirection(axis, heading.angle_rad), kSigma_rad});
    }
    std::erase_if(headings, [&](const Heading& other) {
      return Apart(other.angle_rad, heading.angle_rad) < kMinApart_rad;
    });
  }
  return axes;
}

std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad) {
  const double sigma_rad = std::max(kDeviationScale * run.line_deviation_rad, min_sigma_rad);
  std::vector<BuildingAxis> axes = {
      {LineAxis::kVertical, -1, -1, AxisDirection(LineAxis::kVertical, 0), sigma_rad}};
  for (size_t i = 0; i < run.manhattan_worlds.size(); ++i) {
    const ManhattanWorld& world = run.manhattan_worlds[i];
    if (world.withdrawn) continue;
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back({axis, static_cast<int>(i), world.segment,
                      AxisDirection(axis, world.heading_rad), sigma_rad});
    }
  }
  for (size_t i = 0; i < run.sloped_directions.size(); ++i) {
    const SlopedDirection& slope = run.sloped_directions[i];
    if (slope.withdrawn) continue;
    axes.push_back({LineAxis::kSloped, static_cast<int>(i), slope.segment,
                    SlopeDirection(SlopeBlock{slope.azimuth_rad, slope.elevation_rad}.data()),
                    sigma_rad});
  }
  return axes;
}

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
  PointTree::Found found;
  index_.FindWithin(p_world.cast<float>(), kAround_m, &found);
  const Eigen::Vector3d first = direction_world.unitOrthogonal();
  const Eigen::Vector3d second = direction_world.cross(first);
  std::vector<PointAcross> points;
  for (const int i : found.items) {
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
                                    const std::vector<Interval>& intervals) const {
  SurfacesBeside beside;
  for (const Interval& interval : intervals) {
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

}  // namespace slcmap::mapping
