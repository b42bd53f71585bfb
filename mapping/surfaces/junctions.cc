#include "mapping/surfaces/junctions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "data/core/math.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kBin_m = 0.05;  // along a junction
// What has to be measured of both surfaces, or filled, at a place of a junction.
constexpr double kBeside_m = 0.03;  // on either side of a plane, in which its points are
constexpr double kWindow_m = 0.1;   // to either side along the junction
constexpr int kMinPoints = 4;       // in there, of each plane
constexpr double kMaxGap_m = 0.6;   // from the junction to the nearest of them
// Where surfaces are off their planes, around a place.
constexpr double kOffsetReach_m = 1.0;  // along the planes
constexpr double kCorner_m = 0.05;      // from the junction, in which points are of neither surface
constexpr double kKnown_m = 0.05;       // from a line of the images, in which nothing is added
constexpr double kMinLength_m = 0.3;    // of what is added
constexpr double kCloseGap_m = 0.1;     // in it, that is closed

constexpr double kFacing = 0.8;     // least cosine between a point's normal and its plane's
constexpr double kMaxCosine = 0.5;  // between the normals of planes that meet

double DistanceTo(const BuildingPlane& plane, const Vector3d& p) {
  return plane.normal.dot(p) - plane.offset_m;
}

AlignedBox3d Grown(AlignedBox3d box, double by_m) {
  if (box.isEmpty()) return box;
  box.min().array() -= by_m;
  box.max().array() += by_m;
  return box;
}

// The points of a surface around one bin of a junction.
struct Bin {
  int points = 0;  // within reach of the junction
  double gap_m =
      std::numeric_limits<double>::infinity();  // from the junction to the nearest of them
  std::vector<double> offsets_m;  // of those that are beyond the corner, from the plane
};

// The points of `surface` in front of `other`, by the bin along the junction.
std::map<int, Bin> FindBins(const SurfacePoints& surface, const BuildingPlane& other,
                            const Vector3d& direction, const JunctionOptions& options) {
  std::map<int, Bin> bins;
  for (const Vector3d& p : surface.points_world) {
    const double from_junction_m = DistanceTo(other, p);
    if (from_junction_m < 0 || from_junction_m > kOffsetReach_m) continue;
    Bin& bin = bins[static_cast<int>(std::floor(direction.dot(p) / kBin_m))];
    if (from_junction_m <= options.reach_m) {
      ++bin.points;
      bin.gap_m = std::min(bin.gap_m, from_junction_m);
    }
    if (from_junction_m >= kCorner_m) {
      bin.offsets_m.push_back(DistanceTo(*surface.plane, p));
    }
  }
  return bins;
}

// Up to a number of bins to either side of one.
template <typename Take>
void ForBinsAround(const std::map<int, Bin>& bins, int index, double around_m, double bin_m,
                   Take take) {
  const int around = static_cast<int>(std::lround(around_m / bin_m));
  for (auto bin = bins.lower_bound(index - around);
       bin != bins.end() && bin->first <= index + around; ++bin) {
    take(bin->second);
  }
}

// The points of a surface that is measured near a bin; 0 where it is not.
int PointsAt(const std::map<int, Bin>& bins, int index) {
  int points = 0;
  double gap_m = std::numeric_limits<double>::infinity();
  ForBinsAround(bins, index, kWindow_m, kBin_m, [&](const Bin& bin) {
    points += bin.points;
    gap_m = std::min(gap_m, bin.gap_m);
  });
  return points >= kMinPoints && gap_m <= kMaxGap_m ? points : 0;
}

// How far a surface is off its plane around a bin.
double OffsetAt_m(const std::map<int, Bin>& bins, int index) {
  std::vector<double> offsets_m;
  ForBinsAround(bins, index, kOffsetReach_m, kBin_m, [&](const Bin& bin) {
    offsets_m.insert(offsets_m.end(), bin.offsets_m.begin(), bin.offsets_m.end());
  });
  return offsets_m.empty() ? 0 : Quantile(std::move(offsets_m), 0.5);
}

bool IsBetweenCorners(const PlaneOpening& opening, const Vector3d& axis, const Vector3d& p,
                      double before_m = 0) {
  double from_m = std::numeric_limits<double>::infinity(), to_m = -from_m;
  for (const Vector3d& corner : opening.outline_world) {
    from_m = std::min(from_m, axis.dot(corner));
    to_m = std::max(to_m, axis.dot(corner));
  }
  return axis.dot(p) >= from_m - before_m && axis.dot(p) <= to_m;
}

// In a doorway a wall meets no floor, but what is measured beside it is near enough. Its sill may
// be somewhat above the floor; at its sides and above it there is wall.
bool IsInOpening(const BuildingPlane& plane, const Vector3d& direction, const Vector3d& p) {
  constexpr double kSill_m = 0.1, kUpright = 0.5;
  Vector3d across = plane.normal.cross(direction);
  if (across.z() < 0) across = -across;
  const double below_m = across.z() > kUpright ? kSill_m : 0;
  return std::any_of(plane.openings.begin(), plane.openings.end(), [&](const PlaneOpening& o) {
    return IsBetweenCorners(o, direction, p) && IsBetweenCorners(o, across, p, below_m);
  });
}

bool MayMeet(const SurfacePoints& a, const SurfacePoints& b, const JunctionOptions& options) {
  return std::abs(a.plane->normal.dot(b.plane->normal)) <= kMaxCosine &&
         Grown(a.box, options.reach_m).intersects(b.box);
}

}  // namespace

std::vector<SurfacePoints> PointsOfPlanes(const Building& building,
                                          const std::vector<DensePoint>& cloud,
                                          const JunctionOptions& options) {
  std::vector<SurfacePoints> surfaces;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind == PlaneKind::kOther) continue;
    SurfacePoints surface{&plane, {}, {}};
    AlignedBox3d box;
    for (const Vector3d& corner : plane.outline_world) box.extend(corner);
    box = Grown(box, options.reach_m);
    for (const DensePoint& point : cloud) {
      if (!box.contains(point.p_world) || std::abs(DistanceTo(plane, point.p_world)) > kBeside_m ||
          plane.normal.dot(point.normal_world) < kFacing) {
        continue;
      }
      surface.points_world.push_back(point.p_world);
      surface.box.extend(point.p_world);
    }
    surfaces.push_back(std::move(surface));
  }
  return surfaces;
}

Vector3d PlaneJunction::At(double along_m, const Eigen::Vector2d& offset_m) const {
  Eigen::Matrix3d rows;
  rows << planes[0]->normal.transpose(), planes[1]->normal.transpose(), direction_world.transpose();
  return rows.inverse() *
         Vector3d(planes[0]->offset_m + offset_m[0], planes[1]->offset_m + offset_m[1], along_m);
}

std::optional<PlaneJunction> FindJunction(const SurfacePoints& first, const SurfacePoints& second,
                                          const JunctionOptions& options) {
  if (!MayMeet(first, second, options)) return std::nullopt;
  PlaneJunction junction;
  junction.planes[0] = first.plane;
  junction.planes[1] = second.plane;
  junction.direction_world = first.plane->normal.cross(second.plane->normal).normalized();
  const auto bins = FindBins(first, *second.plane, junction.direction_world, options);
  const auto others = FindBins(second, *first.plane, junction.direction_world, options);
  if (bins.empty() || others.empty()) return std::nullopt;
  const int begin = std::max(bins.begin()->first, others.begin()->first);
  const int end = std::min(bins.rbegin()->first, others.rbegin()->first);
  for (int i = begin; i <= end; ++i) {
    const int points = PointsAt(bins, i), of_other = PointsAt(others, i);
    if (points == 0 || of_other == 0) continue;
    const double along_m = (i + 0.5) * kBin_m;
    const Vector3d on_planes = junction.At(along_m, Eigen::Vector2d::Zero());
    if (IsInOpening(*first.plane, junction.direction_world, on_planes) ||
        IsInOpening(*second.plane, junction.direction_world, on_planes)) {
      continue;
    }
    junction.places.push_back({along_m, {OffsetAt_m(bins, i), OffsetAt_m(others, i)}});
    junction.points += points + of_other;
  }
  if (junction.places.empty()) return std::nullopt;
  return junction;
}

namespace {

using Eigen::Vector2d;

constexpr double kParallel = 0.9986;  // cosine of 3 degrees
constexpr double kSameAxis = 0.9998;  // of 1 degree
constexpr double kSampled_m = 0.04;   // between places of lines that are looked up
// Of where surfaces meet, besides their planes' sigma, over a length in which it is about the same;
// and how far surfaces that belong to one plane may turn from it.
constexpr double kOwnSigma_m = 0.008, kAlike_m = 0.8, kTurn_rad = 0.001;

// Lines by their places, to look up whether one is near.
class KnownEdges {
 public:
  explicit KnownEdges(double near_m) : near_m_(near_m), index_(std::max(near_m, kSampled_m)) {}

  void Add(const Vector3d& start, const Vector3d& end) {
    const Vector3d along = end - start;
    const int steps = std::max(1, static_cast<int>(std::ceil(along.norm() / kSampled_m)));
    for (int i = 0; i <= steps; ++i) {
      index_.Add(start + along * (static_cast<double>(i) / steps), directions_.size());
    }
    directions_.push_back(along.normalized());
  }

  bool Has(const Vector3d& p, const Vector3d& direction) const {
    return index_.AnyNear(p, near_m_, [&](size_t line) {
      return std::abs(directions_[line].dot(direction)) > kParallel;
    });
  }

 private:
  const double near_m_;
  PointIndex index_;
  std::vector<Vector3d> directions_;
};

// The places of a junction, without those that are known, in pieces without a gap.
std::vector<std::vector<JunctionPlace>> MakePieces(const PlaneJunction& junction,
                                                   const KnownEdges& known) {
  std::vector<std::vector<JunctionPlace>> pieces;
  for (const JunctionPlace& place : junction.places) {
    const Vector3d p = junction.At(place.along_m, place.offset_m);
    if (known.Has(p, junction.direction_world)) continue;
    const bool goes_on =
        !pieces.empty() && place.along_m - pieces.back().back().along_m <= kCloseGap_m + kBin_m;
    if (!goes_on) pieces.emplace_back();
    pieces.back().push_back(place);
  }
  return pieces;
}

// Offsets along a piece as a straight line: their mean, and its slope, which is held near none.
struct StraightOffsets {
  Vector2d mean_m = Vector2d::Zero(), slope = Vector2d::Zero();
  double middle_m = 0;

  Vector2d At(double along_m) const { return mean_m + (along_m - middle_m) * slope; }
};

StraightOffsets FitOffsets(const std::vector<JunctionPlace>& piece) {
  StraightOffsets fit;
  const double count = static_cast<double>(piece.size());
  for (const JunctionPlace& place : piece) {
    fit.mean_m += place.offset_m / count;
    fit.middle_m += place.along_m / count;
  }
  double spread_m2 = std::pow(kOwnSigma_m / kTurn_rad, 2) * kAlike_m / kBin_m;  // the prior's
  for (const JunctionPlace& place : piece) {
    fit.slope += (place.along_m - fit.middle_m) * (place.offset_m - fit.mean_m);
    spread_m2 += std::pow(place.along_m - fit.middle_m, 2);
  }
  fit.slope /= spread_m2;
  return fit;
}

int64_t BinsBetween(const JunctionPlace& first, const JunctionPlace& last) {
  return std::lround((last.along_m - first.along_m) / kBin_m) + 1;
}

JunctionEdge MakeEdge(const PlaneJunction& junction, const std::vector<JunctionPlace>& piece) {
  const StraightOffsets offsets = FitOffsets(piece);
  const double from_m = piece.front().along_m - kBin_m / 2;
  const double to_m = piece.back().along_m + kBin_m / 2;
  return {{junction.planes[0], junction.planes[1]},
          junction.At(from_m, offsets.At(from_m)),
          junction.At(to_m, offsets.At(to_m))};
}

std::vector<PlaneJunction> FindJunctions(const Building& building,
                                         const std::vector<DensePoint>& cloud,
                                         const JunctionOptions& options, const Progress& progress) {
  const std::vector<SurfacePoints> surfaces = PointsOfPlanes(building, cloud, options);
  std::vector<PlaneJunction> junctions;
  for (size_t i = 0; i < surfaces.size(); ++i) {
    if (!progress.Report(static_cast<double>(i) / static_cast<double>(surfaces.size()))) return {};
    for (size_t j = i + 1; j < surfaces.size(); ++j) {
      auto junction = FindJunction(surfaces[i], surfaces[j], options);
      if (junction) junctions.push_back(std::move(*junction));
    }
  }
  std::stable_sort(junctions.begin(), junctions.end(),
                   [](const auto& a, const auto& b) { return a.points > b.points; });
  return junctions;
}

// The key of most length; `otherwise` where there is none.
template <typename Key>
Key FindLongest(const std::map<Key, double>& length_m, const Key& otherwise) {
  const auto longest =
      std::max_element(length_m.begin(), length_m.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return longest == length_m.end() ? otherwise : longest->first;
}

// The axis and world that most of the length of lines along a direction has.
std::pair<LineAxis, int> AxisAlong(const Vector3d& direction, const std::vector<MapLine>& lines) {
  std::map<std::pair<LineAxis, int>, double> length_m;
  for (const MapLine& line : lines) {
    const Vector3d along = line.end_world - line.start_world;
    if (line.axis == LineAxis::kNone || std::abs(along.dot(direction)) < kSameAxis * along.norm()) {
      continue;
    }
    length_m[{line.axis, line.world}] += along.norm();
  }
  return FindLongest(length_m, std::pair(LineAxis::kNone, -1));
}

int64_t NextId(const MapResult& map) {
  int64_t id = 0;
  for (const MapLine& line : map.lines) id = std::max(id, line.id + 1);
  for (const MapLine& line : map.marks) id = std::max(id, line.id + 1);
  return id;
}

// What both planes' offsets may be off, at either end alike.
LineCovariance ComputeCovariance(const JunctionEdge& edge, int64_t id) {
  Eigen::Matrix<double, 2, 3> normals;
  normals << edge.planes[0]->normal.transpose(), edge.planes[1]->normal.transpose();
  const Eigen::Matrix<double, 3, 2> across =
      normals.transpose() * (normals * normals.transpose()).inverse();
  Vector2d variance_m2;
  for (int i = 0; i < 2; ++i) {
    variance_m2[i] = std::pow(edge.planes[i]->sigma_m, 2) + std::pow(kOwnSigma_m, 2);
  }
  const Eigen::Matrix3d covariance = across * variance_m2.asDiagonal() * across.transpose();
  return {id, 0, covariance, covariance, covariance};
}

double LargestSigma_m(const LineCovariance& known) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(known.start_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

int SegmentOfMost(const std::vector<MapLine>& lines) {
  std::map<int, double> length_m;
  for (const MapLine& line : lines) {
    length_m[line.segment] += (line.end_world - line.start_world).norm();
  }
  return FindLongest(length_m, 0);
}

}  // namespace

std::vector<JunctionEdge> FindJunctionEdges(const Building& building,
                                            const std::vector<DensePoint>& cloud,
                                            const std::vector<MapLine>& lines,
                                            const JunctionOptions& options,
                                            const Progress& progress) {
  options.Check();
  KnownEdges known(kKnown_m);
  for (const MapLine& line : lines) known.Add(line.start_world, line.end_world);
  const auto min_bins = std::lround(kMinLength_m / kBin_m);
  std::vector<JunctionEdge> edges;
  for (const PlaneJunction& junction : FindJunctions(building, cloud, options, progress)) {
    for (const auto& piece : MakePieces(junction, known)) {
      if (BinsBetween(piece.front(), piece.back()) < min_bins) continue;
      const JunctionEdge edge = MakeEdge(junction, piece);
      known.Add(edge.start_world, edge.end_world);
      edges.push_back(edge);
    }
  }
  return edges;
}

void AddJunctions(const JunctionOptions& options, const Progress& progress, MapResult* map) {
  if (!options.add) return;
  const std::vector<MapLine> shown = map->lines;
  const int segment = SegmentOfMost(shown);
  int64_t id = NextId(*map);
  std::vector<DensePoint> cloud = map->dense;
  cloud.insert(cloud.end(), map->filled.begin(), map->filled.end());
  for (const JunctionEdge& edge :
       FindJunctionEdges(map->building, cloud, map->lines, options, progress)) {
    const LineCovariance covariance = ComputeCovariance(edge, id);
    MapLine line;
    line.id = id++;
    line.start_world = edge.start_world;
    line.end_world = edge.end_world;
    const Vector3d direction = (edge.end_world - edge.start_world).normalized();
    std::tie(line.axis, line.world) = AxisAlong(direction, shown);
    line.segment = segment;
    line.sigma_m = LargestSigma_m(covariance);
    line.SetProbability(1);
    map->lines.push_back(line);
    map->line_evidence.covariances.push_back(covariance);
  }
}

void RemoveJunctions(MapResult* map) {
  std::set<int64_t> ids;
  for (const MapLine& line : map->lines) {
    if (IsJunction(line)) ids.insert(line.id);
  }
  std::erase_if(map->lines, IsJunction);
  std::erase_if(map->line_evidence.covariances,
                [&](const LineCovariance& known) { return ids.contains(known.line_id); });
}

}  // namespace slcmap::mapping
