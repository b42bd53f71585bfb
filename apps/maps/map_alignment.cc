#include <spdlog/fmt/fmt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_set>

#include "apps/maps/truth_agreement.h"
#include "data/core/error.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr size_t kSamples = 1500, kRoughSamples = 250;
constexpr double kOn_m = 0.1;      // a sample so near lies on the truth
constexpr double kFits = 0.6;      // share of samples, for a map to be left where it is
constexpr double kLeastFit = 0.3;  // for it to be of the same building
// Below it other units are tried: floors alone lie on floors in any.
constexpr double kSurelyFits = 0.75;
constexpr double kBin_m = 0.05;
constexpr int kPeaks = 4, kApart = 4;  // of the shifts along an axis; bins between them
constexpr double kRough_m = 0.25;
constexpr size_t kRefined = 8;  // of the rough places
constexpr double kAlongAxis = 0.96;
constexpr double kLineSample_m = 0.1;
constexpr double kLargest_m = 3000, kSmallest_m = 0.5;  // of a building

// Metres of a unit, and what it is called.
struct LengthUnit {
  double metres;
  const char* name;
};
constexpr LengthUnit kUnits[] = {
    {0.001, "millimetres"}, {0.01, "centimetres"}, {0.3048, "feet"}, {0.0254, "inches"}};

double Share(size_t part, size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

double Overlap(const MapSamples& map, const TrueScan& truth, const RigidTransform& T) {
  size_t on = 0;
  for (const Vector3d& p : map.places) {
    on += truth.planes.Find(T * p, kOn_m + kRounding_m).has_value();
  }
  return Share(on, map.places.size());
}

Vector3d FindMiddle(const MapSamples& map) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : map.places) middle += p / static_cast<double>(map.places.size());
  return middle;
}

// Point to plane, with planes that come nearer as it goes on. Turned about the middle of the map:
// its origin may be as far as that of UTM.
RigidTransform Refine(const MapSamples& map, const TrueScan& truth, RigidTransform T) {
  const Vector3d middle_map = FindMiddle(map);
  constexpr double kReaches_m[] = {0.5,  0.5,  0.5, 0.3, 0.3, 0.3, 0.2, 0.2,
                                   0.15, 0.15, 0.1, 0.1, 0.1, 0.1, 0.1};
  for (const double reach_m : kReaches_m) {
    const Vector3d middle = T * middle_map;
    Eigen::Matrix<double, 6, 6> information = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    for (size_t i = 0; i < map.places.size(); ++i) {
      const Vector3d p = T * map.places[i], normal = T.rotation * map.directions[i];
      const auto near = truth.planes.Find(p, reach_m, map.are_lines ? nullptr : &normal);
      if (!near) continue;
      const Vector3d n = truth.map.cubes()[near->cube].normal;
      const double weight = 1 / (1 + std::pow(near->off_m / (0.3 * reach_m), 2));
      Eigen::Matrix<double, 6, 1> row;
      row << (p - middle).cross(n), n;
      information += weight * row * row.transpose();
      gradient -= weight * near->off_m * row;
    }
    const Eigen::Matrix<double, 6, 1> step = information.ldlt().solve(gradient);
    T.rotation = (ExpRotation(step.head<3>()) * T.rotation).normalized();
    T.translation = middle + step.tail<3>() - T.rotation * middle_map;
  }
  return T;
}

// How many samples lie at which offset along an axis, of walls across it.
using Offsets = std::map<int64_t, double>;

Offsets CountOffsets(const MapSamples& map, const Matrix3d& turn, const Vector3d& axis) {
  Offsets offsets;
  for (size_t i = 0; i < map.places.size(); ++i) {
    const double along = std::abs(axis.dot(turn * map.directions[i]));
    const bool counts = map.are_lines ? along < 1 - kAlongAxis : along > kAlongAxis;
    if (counts) ++offsets[std::lround(axis.dot(turn * map.places[i]) / kBin_m)];
  }
  return offsets;
}

// The shifts, in bins, at which most offsets of the second are those of the first.
std::vector<int64_t> BestShifts(const Offsets& truth, const Offsets& map) {
  std::map<int64_t, double> votes;
  for (const auto& [at, count] : truth) {
    for (const auto& [from, also] : map) {
      for (const int64_t beside : {-1, 0, 1}) {
        votes[at - from + beside] += (beside == 0 ? 1 : 0.5) * std::sqrt(count * also);
      }
    }
  }
  std::vector<std::pair<double, int64_t>> sorted;
  for (const auto& [shift, vote] : votes) sorted.emplace_back(-vote, shift);
  std::sort(sorted.begin(), sorted.end());
  std::vector<int64_t> best;
  for (const auto& [vote, shift] : sorted) {
    const bool is_new = std::all_of(best.begin(), best.end(), [shift = shift](int64_t other) {
      return std::abs(other - shift) > kApart;
    });
    if (is_new) best.push_back(shift);
    if (static_cast<int>(best.size()) == kPeaks) break;
  }
  if (best.empty()) best.push_back(0);
  return best;
}

// The turns that lay the axes of a map along those of the truth.
std::vector<Matrix3d> AxisTurns(const BuildingAxes& map, const BuildingAxes& truth) {
  std::vector<Matrix3d> turns;
  const bool stays_up = map.is_z_up && truth.is_z_up;
  const int orders[6][3] = {{0, 1, 2}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}};
  for (const auto& order : orders) {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d permuted = Matrix3d::Zero();
      for (int axis = 0; axis < 3; ++axis) permuted(order[axis], axis) = signs >> axis & 1 ? -1 : 1;
      if (permuted.determinant() < 0) continue;
      if (stays_up && permuted(2, 2) < 0.5) continue;
      turns.push_back(truth.axes * permuted * map.axes.transpose());
    }
  }
  return turns;
}

struct RoughPlace {
  double share = 0;
  RigidTransform T;
};

std::vector<RoughPlace> RoughPlaces(const MapSamples& map, const TrueScan& truth) {
  std::unordered_set<int64_t> seen;  // places of the truth, coarsely
  for (const SurfaceCube& cube : truth.map.cubes()) {
    if (cube.is_plane) seen.insert(MakeKey(FindCube(cube.p, kRough_m)));
  }
  std::vector<RoughPlace> places;
  for (const Matrix3d& turn : AxisTurns(map.axes, truth.samples.axes)) {
    std::vector<int64_t> shifts[3];
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d along = truth.samples.axes.axes.col(axis);
      shifts[axis] = BestShifts(CountOffsets(truth.samples, Matrix3d::Identity(), along),
                                CountOffsets(map, turn, along));
    }
    for (const int64_t x : shifts[0]) {
      for (const int64_t y : shifts[1]) {
        for (const int64_t z : shifts[2]) {
          const Vector3d t = truth.samples.axes.axes * kBin_m *
                             Eigen::Matrix<int64_t, 3, 1>(x, y, z).cast<double>();
          RoughPlace place{0, {Eigen::Quaterniond(turn), t}};
          const size_t count = std::min(kRoughSamples, map.places.size());
          size_t on = 0;
          for (size_t i = 0; i < count; ++i) {
            on += seen.count(MakeKey(FindCube(place.T * map.places[i], kRough_m)));
          }
          place.share = Share(on, count);
          places.push_back(place);
        }
      }
    }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const auto& a, const auto& b) { return a.share > b.share; });
  if (places.size() > kRefined) places.resize(kRefined);
  return places;
}

bool IsElsewhere(const RigidTransform& a, const RigidTransform& b, const Vector3d& middle) {
  return (a * middle - b * middle).norm() > 0.5 || a.rotation.angularDistance(b.rotation) > 0.2;
}

ScanPlacement Search(const MapSamples& map, const TrueScan& truth) {
  RigidTransform as_it_is;
  ScanPlacement best{Refine(map, truth, as_it_is), 0, 0};
  best.overlap = Overlap(map, truth, best.T_truth_map);
  if (best.overlap >= kFits || !map.axes.are_found || !truth.samples.axes.are_found) return best;
  const Vector3d middle = FindMiddle(map);
  std::vector<ScanPlacement> all{best};
  for (const RoughPlace& rough : RoughPlaces(map, truth)) {
    ScanPlacement placed{Refine(map, truth, rough.T), 0, 0};
    placed.overlap = Overlap(map, truth, placed.T_truth_map);
    all.push_back(placed);
    if (placed.overlap > best.overlap) best = placed;
  }
  for (const ScanPlacement& other : all) {
    if (IsElsewhere(other.T_truth_map, best.T_truth_map, middle)) {
      best.rival = std::max(best.rival, other.overlap);
    }
  }
  return best;
}

MapSamples Scaled(MapSamples map, double scale) {
  for (Vector3d& p : map.places) p *= scale;
  return map;
}

[[noreturn]] void RefuseUnit(const std::string& name, const Vector3d& found,
                             const Vector3d& expected, const LengthUnit* map_in,
                             const LengthUnit* truth_in) {
  const std::string unit = map_in ? fmt::format("the map looks to be in {}: --map-scale NAME={:g}",
                                                map_in->name, map_in->metres)
                           : truth_in
                               ? fmt::format("the truth looks to be in {}: --true-scale {:g}",
                                             truth_in->name, truth_in->metres)
                               : "scale one of them with --map-scale NAME=S or --true-scale S";
  throw DataError(fmt::format(
      "{}: found extents of {:.4g} x {:.4g} x {:.4g}, expected about those of the truth, {:.4g} x "
      "{:.4g} x {:.4g}; {}",
      name, found[2], found[1], found[0], expected[2], expected[1], expected[0], unit));
}

// Units whose ratio the extents have, best first.
void RefuseByExtents(const std::string& name, const Vector3d& found, const Vector3d& expected) {
  constexpr double kTooDifferent = 15;
  const double ratio = found.norm() / expected.norm();
  if (ratio < kTooDifferent && ratio > 1 / kTooDifferent) return;
  const LengthUnit* best = nullptr;
  double best_off = 1.2;
  for (const LengthUnit& unit : kUnits) {
    const double off = std::abs(std::log(std::max(ratio, 1 / ratio) * unit.metres));
    if (off < best_off) best_off = off, best = &unit;
  }
  RefuseUnit(name, found, expected, ratio > 1 ? best : nullptr, ratio > 1 ? nullptr : best);
}

// Where a map does not fit: whether it would in other units.
void RefuseByFit(const std::string& name, const MapSamples& map, const TrueScan& truth,
                 const ScanPlacement& placed) {
  const Vector3d found = FindExtents(map.places), expected = FindExtents(truth.samples.places);
  for (const LengthUnit& unit : kUnits) {
    for (const bool is_map : {true, false}) {
      const double scale = is_map ? unit.metres : 1 / unit.metres;
      const double ratio = scale * found.norm() / expected.norm();
      if (ratio > 2 || ratio < 0.5) continue;
      const ScanPlacement other = Search(Scaled(map, scale), truth);
      if (other.overlap < std::max(kFits, 1.5 * placed.overlap)) continue;
      RefuseUnit(name, found, expected, is_map ? &unit : nullptr, is_map ? nullptr : &unit);
    }
  }
}

}  // namespace

MapSamples SampleSurfaces(const SurfaceMap& map) {
  MapSamples samples;
  for (const size_t i : map.SomePlanes(kSamples)) {
    samples.places.push_back(map.cubes()[i].p);
    samples.directions.push_back(map.cubes()[i].normal);
  }
  if (!samples.places.empty()) samples.axes = FindAxes(samples.directions, samples.places);
  if (samples.axes.are_found) {
    samples.axes = WithUp(samples.axes, FindUpOfFloors(samples.axes, samples.directions));
  }
  return samples;
}

MapSamples SampleLines(const std::vector<PlySegment>& lines) {
  MapSamples all;
  all.are_lines = true;
  for (const auto& [start, end] : lines) {
    const double length_m = (end - start).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length_m / kLineSample_m)));
    for (int i = 0; i < steps; ++i) {
      all.places.push_back(start + (end - start) * (i + 0.5) / steps);
      all.directions.push_back((end - start) / length_m);
    }
  }
  std::vector<size_t> order(all.places.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [](size_t a, size_t b) { return MixBits(a) < MixBits(b); });
  if (order.size() > kSamples) order.resize(kSamples);
  MapSamples some;
  some.are_lines = true;
  for (const size_t i : order) {
    some.places.push_back(all.places[i]);
    some.directions.push_back(all.directions[i]);
  }
  if (!some.places.empty()) some.axes = FindAxes(some.directions, some.places);
  return some;
}

TrueScan::TrueScan(std::vector<Vector3d> points)
    : map(std::move(points)), planes(map), samples(SampleSurfaces(map)) {}

void RefuseOtherUnits(const std::string& name, const std::vector<Vector3d>& places) {
  const Vector3d extents = FindExtents(places);
  if (extents[2] < kLargest_m && extents[2] > kSmallest_m) return;
  const bool is_large = extents[2] >= kLargest_m;
  throw DataError(fmt::format(
      "{}: found extents of {:.4g} x {:.4g} x {:.4g}, expected a building in metres; {}", name,
      extents[2], extents[1], extents[0],
      is_large ? "is it in millimetres? --map-scale NAME=0.001 (of the truth: --true-scale 0.001)"
               : "what are its units? --map-scale NAME=S (of the truth: --true-scale S)"));
}

ScanPlacement PlaceOnTruth(const std::string& name, const MapSamples& map, const TrueScan& truth,
                           bool as_it_is) {
  RefuseByExtents(name, FindExtents(map.places), FindExtents(truth.samples.places));
  ScanPlacement placed;
  placed.overlap = as_it_is ? Overlap(map, truth, placed.T_truth_map) : 0;
  if (!as_it_is) placed = Search(map, truth);
  if (placed.overlap < kSurelyFits) RefuseByFit(name, map, truth, placed);
  if (placed.overlap >= kLeastFit) return placed;
  throw DataError(fmt::format(
      "{}: found {:.0f} % of it within {:.0f} cm of the truth, expected {:.0f} % or more; {}", name,
      100 * placed.overlap, 100 * kOn_m, 100 * kLeastFit,
      as_it_is ? "is it in the world of the truth? Without --as-they-are it is laid on it"
               : "is it of the same building?"));
}

}  // namespace slcmap::evaluation
