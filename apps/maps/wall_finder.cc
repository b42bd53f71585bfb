#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "apps/maps/map_straightness.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kUpright = 0.34;      // most of a normal that points up: 20 degrees
constexpr double kNextCosine = 0.966;  // of normals of neighbours: 15 degrees
constexpr double kFaceCosine = 0.906;  // of a normal and that of the first: 25 degrees
constexpr double kStep = 0.35;         // of a cube, from the plane of a neighbour to the next
constexpr double kFlat = 1e-6;         // what rounding leaves of a plane's flatness, and more
constexpr double kPieceLeast_m = 0.4;  // of a piece of a wall
constexpr double kFaceLength_m = 1, kFaceHeight_m = 0.8;  // without their borders
constexpr double kGap_m = 2;                              // along a wall, where it was not seen
constexpr double kJoint_m = 0.02;                         // across it, of two pieces of one wall
constexpr double kJointCosine = 0.998;                    // of their normals: 3.5 degrees
constexpr double kAreaCell_m = 0.1;                       // of the samples that share an area
constexpr double kOutlier = 3.5;                          // standard deviations from the face
constexpr double kLeastNoise_m = 0.002;
constexpr double kBefore_m = 0.08;  // from the planes of its cubes, at most
constexpr double kProfile_m = 0.25;
constexpr double kBorder_m = 0.15;

using Cubes = std::vector<size_t>;

bool IsUpright(const SurfaceCube& cube, const Vector3d& up) {
  return cube.is_plane && std::abs(cube.normal.dot(up)) < kUpright;
}

// Surfaces that grow from the flattest places on, over neighbours that go on as they do.
std::vector<Cubes> GrowPieces(const SurfaceMap& map, const Vector3d& up) {
  const std::vector<SurfaceCube>& cubes = map.cubes();
  std::vector<size_t> order;
  for (size_t i = 0; i < cubes.size(); ++i) {
    if (IsUpright(cubes[i], up)) order.push_back(i);
  }
  // Of planes without noise rounding would tell which is the flattest.
  const auto flatness = [&](size_t i) { return std::max(kFlat, cubes[i].flatness); };
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return flatness(a) < flatness(b); });
  std::vector<bool> taken(cubes.size(), false);
  std::vector<Cubes> pieces;
  for (const size_t seed : order) {
    if (taken[seed]) continue;
    Cubes piece{seed};
    taken[seed] = true;
    for (size_t k = 0; k < piece.size(); ++k) {
      const SurfaceCube& here = cubes[piece[k]];
      map.ForEachAround(piece[k], [&](size_t other) {
        const SurfaceCube& next = cubes[other];
        if (taken[other] || !IsUpright(next, up)) return;
        if (std::abs(next.normal.dot(here.normal)) < kNextCosine) return;
        if (std::abs(next.normal.dot(cubes[seed].normal)) < kFaceCosine) return;
        if (std::abs(here.normal.dot(next.p - here.p)) > kStep * map.cube_m()) return;
        taken[other] = true;
        piece.push_back(other);
      });
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

// A piece as a stretch of a plan.
struct Stretch {
  Vector3d middle, normal, along, upwards;
  double from_m = 0, to_m = 0;  // along, from the middle
  double low_m = 0, high_m = 0;
};

Stretch FitStretch(const SurfaceMap& map, const Cubes& piece, const Vector3d& up) {
  Stretch s{Vector3d::Zero(), {}, {}, {}};
  for (const size_t i : piece) s.middle += map.cubes()[i].p / static_cast<double>(piece.size());
  Matrix3d spread = Matrix3d::Zero();
  // Level directions only: a low and long piece has no lean of its own.
  for (const size_t i : piece) {
    Vector3d offset = map.cubes()[i].p - s.middle;
    offset -= up.dot(offset) * up;
    spread += offset * offset.transpose();
  }
  s.along = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(2);
  s.along = (s.along - up.dot(s.along) * up).normalized();
  s.normal = s.along.cross(up);
  s.upwards = up;
  std::vector<double> along, upwards;
  for (const size_t i : piece) {
    along.push_back(s.along.dot(map.cubes()[i].p - s.middle));
    upwards.push_back(up.dot(map.cubes()[i].p - s.middle));
  }
  s.from_m = Quantile(along, 0.01), s.to_m = Quantile(along, 0.99);
  s.low_m = Quantile(upwards, 0.01), s.high_m = Quantile(upwards, 0.99);
  return s;
}

// Whether two pieces are of one wall: where one ends the other goes on, on the same line.
bool GoesOn(const Stretch& a, const Stretch& b) {
  if (std::abs(a.normal.dot(b.normal)) < kJointCosine) return false;
  const Vector3d b_from = b.middle + b.from_m * b.along, b_to = b.middle + b.to_m * b.along;
  double from_m = a.along.dot(b_from - a.middle), to_m = a.along.dot(b_to - a.middle);
  Vector3d near = b_from;
  if (from_m > to_m) std::swap(from_m, to_m), near = b_to;
  if (from_m > a.to_m + kGap_m || to_m < a.from_m - kGap_m) return false;
  // Beside each other: across, where they are both; else where the second begins.
  if (to_m < a.to_m) near = a.along.dot(b_to - a.middle) >= to_m - 1e-9 ? b_to : b_from;
  const double gap_m = std::max({0.0, from_m - a.to_m, a.from_m - to_m});
  return std::abs(a.normal.dot(near - a.middle)) < kJoint_m + 0.01 * gap_m;
}

size_t FindRoot(std::vector<size_t>* parent, size_t i) {
  while ((*parent)[i] != i) i = (*parent)[i] = (*parent)[(*parent)[i]];
  return i;
}

std::vector<Cubes> JoinPieces(const SurfaceMap& map, std::vector<Cubes> pieces,
                              const Vector3d& up) {
  std::vector<Stretch> stretches;
  std::vector<Cubes> kept;
  for (Cubes& piece : pieces) {
    const Stretch s = FitStretch(map, piece, up);
    if (s.to_m - s.from_m < kPieceLeast_m && s.high_m - s.low_m < kPieceLeast_m) continue;
    stretches.push_back(s);
    kept.push_back(std::move(piece));
  }
  std::vector<size_t> parent(kept.size());
  std::iota(parent.begin(), parent.end(), size_t{0});
  for (size_t i = 0; i < kept.size(); ++i) {
    for (size_t j = i + 1; j < kept.size(); ++j) {
      // The longer one says where it goes on.
      const bool is_longer =
          stretches[i].to_m - stretches[i].from_m >= stretches[j].to_m - stretches[j].from_m;
      const Stretch &a = stretches[is_longer ? i : j], &b = stretches[is_longer ? j : i];
      if (GoesOn(a, b)) parent[FindRoot(&parent, j)] = FindRoot(&parent, i);
    }
  }
  std::map<size_t, Cubes> joined;
  for (size_t i = 0; i < kept.size(); ++i) {
    Cubes& all = joined[FindRoot(&parent, i)];
    all.insert(all.end(), kept[i].begin(), kept[i].end());
  }
  std::vector<Cubes> walls;
  for (auto& [root, all] : joined) walls.push_back(std::move(all));
  return walls;
}

// The points near the planes of a wall's cubes, also in the cubes beside them: noise leaves these.
std::vector<int32_t> PointsOn(const SurfaceMap& map, const Cubes& wall) {
  std::map<size_t, double> distance_m;  // by cube: of the nearest of the wall, to compare with
  std::map<size_t, size_t> plane_of;
  const auto consider = [&](size_t cube, size_t of) {
    const double apart_m = (map.cubes()[cube].p - map.cubes()[of].p).norm();
    const auto [entry, is_new] = distance_m.try_emplace(cube, apart_m);
    if (is_new || apart_m < entry->second) entry->second = apart_m, plane_of[cube] = of;
  };
  for (const size_t i : wall) {
    consider(i, i);
    map.ForEachAround(i, [&](size_t other) { consider(other, i); });
  }
  std::vector<int32_t> on;
  for (const auto& [cube, of] : plane_of) {
    const SurfaceCube &plane = map.cubes()[of], &own = map.cubes()[cube];
    if (own.is_plane && std::abs(own.normal.dot(plane.normal)) < kFaceCosine) continue;
    for (const int32_t point : map.cubes()[cube].points) {
      const Vector3d from = map.points()[static_cast<size_t>(point)] - plane.p;
      if (std::abs(plane.normal.dot(from)) < kBefore_m) on.push_back(point);
    }
  }
  return on;
}

// Samples of one area share its weight.
void WeighByArea(std::vector<StraightSample>* samples) {
  std::map<std::pair<int64_t, int64_t>, int> counts;
  const auto cell = [](const StraightSample& s) {
    return std::pair(std::lround(s.along_m / kAreaCell_m), std::lround(s.up_m / kAreaCell_m));
  };
  for (const StraightSample& s : *samples) ++counts[cell(s)];
  for (StraightSample& s : *samples) s.weight = 1.0 / counts[cell(s)];
}

void FitPlane(const SurfaceMap& map, const Vector3d& up, FoundFace* face) {
  double weights = 0;
  Vector3d middle = Vector3d::Zero();
  const auto p = [&](size_t i) { return map.points()[static_cast<size_t>(face->points[i])]; };
  for (size_t i = 0; i < face->points.size(); ++i) {
    const double weight = face->samples[i].weight;
    middle += weight * p(i);
    weights += weight;
  }
  face->middle = middle / weights;
  Matrix3d spread = Matrix3d::Zero();
  for (size_t i = 0; i < face->points.size(); ++i) {
    const Vector3d offset = p(i) - face->middle;
    spread += face->samples[i].weight * offset * offset.transpose();
  }
  const Vector3d before = face->normal;
  face->normal = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(0);
  if (face->normal.dot(before) < 0) face->normal = -face->normal;
  face->along = up.cross(face->normal).normalized();
  face->upwards = face->normal.cross(face->along);
  for (size_t i = 0; i < face->points.size(); ++i) {
    const Vector3d offset = p(i) - face->middle;
    face->samples[i] = {face->along.dot(offset), face->upwards.dot(offset),
                        face->normal.dot(offset), face->samples[i].weight};
  }
}

template <typename Keeps>
void KeepSamples(FoundFace* face, Keeps keeps) {
  std::vector<StraightSample> samples;
  std::vector<int32_t> points;
  for (size_t i = 0; i < face->samples.size(); ++i) {
    if (!keeps(i)) continue;
    samples.push_back(face->samples[i]);
    points.push_back(face->points[i]);
  }
  face->samples = std::move(samples);
  face->points = std::move(points);
}

// Leaves out the border of a face, where others meet it.
void LeaveOutBorder(FoundFace* face) {
  std::vector<double> along, upwards;
  for (const StraightSample& s : face->samples) {
    along.push_back(s.along_m);
    upwards.push_back(s.up_m);
  }
  const double from_m = Quantile(along, 0.002) + kBorder_m,
               to_m = Quantile(along, 0.998) - kBorder_m,
               low_m = Quantile(upwards, 0.002) + kBorder_m,
               high_m = Quantile(upwards, 0.998) - kBorder_m;
  KeepSamples(face, [&](size_t i) {
    const StraightSample& s = face->samples[i];
    return s.along_m > from_m && s.along_m < to_m && s.up_m > low_m && s.up_m < high_m;
  });
}

// Leaves out what is far from the face's own curve: what hangs on a wall or stands before it.
void LeaveOutOutliers(FoundFace* face) {
  std::map<int64_t, std::vector<double>> around;
  const auto place = [](const StraightSample& s) { return std::lround(s.along_m / kProfile_m); };
  for (const StraightSample& s : face->samples) around[place(s)].push_back(s.off_m);
  std::map<int64_t, double> curve;
  for (auto& [at, values] : around) curve[at] = Quantile(values, 0.5);
  std::vector<double> off;
  for (const StraightSample& s : face->samples) off.push_back(std::abs(s.off_m - curve[place(s)]));
  const double limit_m = kOutlier * std::max(kLeastNoise_m, kSigmaOfMedian * Quantile(off, 0.5));
  KeepSamples(face, [&](size_t i) { return off[i] <= limit_m; });
}

FoundFace MakeFace(const SurfaceMap& map, const Cubes& wall, const Vector3d& up) {
  FoundFace face;
  face.points = PointsOn(map, wall);
  face.normal = FitStretch(map, wall, up).normal;
  face.samples.resize(face.points.size());
  FitPlane(map, up, &face);
  LeaveOutBorder(&face);
  for (int iteration = 0; iteration < 3 && face.samples.size() > 3; ++iteration) {
    WeighByArea(&face.samples);
    FitPlane(map, up, &face);
    LeaveOutOutliers(&face);
  }
  if (face.samples.size() <= 3) return face;
  WeighByArea(&face.samples);
  FitPlane(map, up, &face);
  std::vector<double> along, upwards;
  for (const StraightSample& s : face.samples) {
    along.push_back(s.along_m);
    upwards.push_back(s.up_m);
  }
  face.length_m = Quantile(along, 0.995) - Quantile(along, 0.005);
  face.height_m = Quantile(upwards, 0.995) - Quantile(upwards, 0.005);
  face.noise_m = RobustNoise_m(face.samples, kProfile_m);
  return face;
}

}  // namespace

std::vector<FoundFace> FindFaces(const SurfaceMap& map, const Vector3d& up) {
  std::vector<FoundFace> faces;
  for (const Cubes& wall : JoinPieces(map, GrowPieces(map, up), up)) {
    const Stretch s = FitStretch(map, wall, up);
    if (s.to_m - s.from_m < kFaceLength_m || s.high_m - s.low_m < kFaceHeight_m) continue;
    FoundFace face = MakeFace(map, wall, up);
    if (face.length_m >= kFaceLength_m && face.height_m >= kFaceHeight_m) {
      faces.push_back(std::move(face));
    }
  }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const auto& a, const auto& b) { return a.length_m > b.length_m; });
  return faces;
}

}  // namespace slcmap::evaluation
