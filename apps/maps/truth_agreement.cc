#include "apps/maps/truth_agreement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/evaluation/report.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector3d;

constexpr double kTolerances_m[] = {0.02, 0.05, 0.1};
constexpr size_t kMapSamples = 20000, kTruthSamples = 6000, kFaceSamples = 3000;
constexpr double kBeside_m = 0.1, kAcross_m = 0.11;  // what of a map is at a place of the truth
constexpr double kBendReach_m = 0.3;

// Some of the numbers below a count, in an order that is none of space.
std::vector<size_t> Some(size_t count, size_t most) {
  std::vector<size_t> some(count);
  std::iota(some.begin(), some.end(), size_t{0});
  if (count <= most) return some;
  std::nth_element(some.begin(), some.begin() + static_cast<std::ptrdiff_t>(most), some.end(),
                   [](size_t a, size_t b) { return MixBits(a) < MixBits(b); });
  some.resize(most);
  std::sort(some.begin(), some.end());
  return some;
}

// Points of the map by area: each counts by how few there are around it.
struct WeighedPoints {
  std::vector<Vector3d> points;
  std::vector<double> weights;
};

WeighedPoints WeighByCrowd(const SurfaceMap& map) {
  WeighedPoints weighed;
  std::vector<size_t> cube_of(map.points().size());
  std::vector<double> crowd(map.cubes().size());
  for (size_t i = 0; i < map.cubes().size(); ++i) {
    crowd[i] = static_cast<double>(map.cubes()[i].points.size());
    map.ForEachAround(i, [&](size_t other) {
      crowd[i] += static_cast<double>(map.cubes()[other].points.size());
    });
    for (const int32_t p : map.cubes()[i].points) cube_of[static_cast<size_t>(p)] = i;
  }
  for (const size_t i : Some(map.points().size(), kMapSamples)) {
    weighed.points.push_back(map.points()[i]);
    weighed.weights.push_back(1 / crowd[cube_of[i]]);
  }
  return weighed;
}

WeighedPoints AlongLines(const std::vector<PlySegment>& lines) {
  WeighedPoints weighed;
  for (const auto& [start, end] : lines) {
    const double length_m = (end - start).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length_m / 0.05)));
    for (int i = 0; i < steps; ++i) {
      weighed.points.push_back(start + (end - start) * (i + 0.5) / steps);
      weighed.weights.push_back(length_m / steps);
    }
  }
  return weighed;
}

void AddAccuracy(const WeighedPoints& map, const TrueScan& truth, TruthAgreement* agreement) {
  double all = 0, near = 0, squares = 0;
  std::vector<double> within(std::size(kTolerances_m));
  const double reach_m = kTolerances_m[std::size(kTolerances_m) - 1] + kRounding_m;
  for (size_t i = 0; i < map.points.size(); ++i) {
    const double weight = map.weights[i];
    all += weight;
    const auto off_m =
        truth.planes.FindOff_m(agreement->placement.T_truth_map * map.points[i], reach_m);
    if (!off_m) continue;
    near += weight;
    squares += weight * *off_m * *off_m;
    for (size_t k = 0; k < within.size(); ++k) {
      if (*off_m <= kTolerances_m[k] + kRounding_m) within[k] += weight;
    }
  }
  for (size_t k = 0; k < within.size(); ++k) {
    agreement->scores.push_back(
        {kTolerances_m[k], ComputeShare(within[k], all), kNoFigure, kNoFigure});
  }
  agreement->rms_m = std::sqrt(ComputeShare(squares, near));
}

// For each place of the truth, what lies nearest to it of what the map has beside it.
void AddCompleteness(const MapOnScan& placed, const TrueScan& truth, TruthAgreement* agreement) {
  const RigidTransform T_map_truth = placed.placement.T_truth_map.Inverse();
  std::vector<Vector3d> points = placed.map->points();
  if (placed.filled) points.insert(points.end(), placed.filled->begin(), placed.filled->end());
  const Vector3d origin = points.front();
  std::vector<Eigen::Vector3f> places;
  for (const Vector3d& p : points) places.push_back((p - origin).cast<float>());
  const PointTree tree(places);
  const double beside_m = std::max(kBeside_m, 1.5 * placed.map->cube_m());
  PointTree::Found found;
  std::vector<double> covered(std::size(kTolerances_m));
  double all = 0;
  for (const size_t i : truth.map.SomePlanes(kTruthSamples)) {
    ++all;
    const Vector3d p = T_map_truth * truth.map.cubes()[i].p;
    const Vector3d n = T_map_truth.rotation * truth.map.cubes()[i].normal;
    tree.FindWithin((p - origin).cast<float>(), std::hypot(beside_m, kAcross_m), &found);
    double nearest_m = HUGE_VAL;  // the other face of a wall takes nothing from this one
    for (const int item : found.items) {
      const Vector3d from = points[static_cast<size_t>(item)] - p;
      const double off_m = n.dot(from);
      if ((from - off_m * n).norm() > beside_m) continue;
      nearest_m = std::min(nearest_m, std::abs(off_m));
    }
    for (size_t k = 0; k < covered.size(); ++k) {
      covered[k] += nearest_m <= kTolerances_m[k] + kRounding_m;
    }
  }
  for (size_t k = 0; k < covered.size(); ++k) {
    AgreementScore& score = agreement->scores[k];
    score.completeness = ComputeShare(covered[k], all);
    const double sum = score.accuracy + score.completeness;
    score.f = ComputeShare(2 * score.accuracy * score.completeness, sum);
  }
}

// A wall's points by how far they are from the truth, along its own axes.
std::vector<StraightSample> OffTruth(const FoundFace& face, const MapOnScan& placed,
                                     const TrueScan& truth) {
  const RigidTransform& T = placed.placement.T_truth_map;
  const Vector3d normal = T.rotation * face.normal;
  std::vector<StraightSample> samples;
  for (const size_t i : Some(face.samples.size(), kFaceSamples)) {
    const Vector3d p = T * placed.map->points()[static_cast<size_t>(face.points[i])];
    const auto plane = truth.planes.Find(p, kBendReach_m, &normal);
    if (!plane) continue;
    const double side = truth.map.cubes()[plane->cube].normal.dot(normal) < 0 ? -1 : 1;
    StraightSample sample = face.samples[i];
    sample.off_m = side * plane->off_m;
    samples.push_back(sample);
  }
  return samples;
}

void AddBends(const MapOnScan& placed, const TrueScan& truth, TruthAgreement* agreement) {
  std::vector<std::vector<LaidStraightedge>> laid;
  double largest_m = kNoFigure;
  for (const FoundFace& face : *placed.faces) {
    const std::vector<StraightSample> off = OffTruth(face, placed, truth);
    if (static_cast<double>(off.size()) <
        0.5 * static_cast<double>(std::min(face.samples.size(), kFaceSamples))) {
      continue;
    }
    laid.push_back(LayStraightedges(off, face.noise_m));
    largest_m = std::fmax(largest_m, WholeGap_m(off, face.noise_m));
  }
  agreement->bends = Summarize(laid);
  agreement->whole_bend_m = largest_m;
}

}  // namespace

TruthAgreement MeasureAgreement(const MapOnScan& placed, const TrueScan& truth) {
  TruthAgreement agreement;
  agreement.placement = placed.placement;
  agreement.whole_bend_m = kNoFigure;
  AddAccuracy(placed.map ? WeighByCrowd(*placed.map) : AlongLines(*placed.lines), truth,
              &agreement);
  if (placed.map) {
    AddCompleteness(placed, truth, &agreement);
    AddBends(placed, truth, &agreement);
  }
  return agreement;
}

}  // namespace slcmap::evaluation
