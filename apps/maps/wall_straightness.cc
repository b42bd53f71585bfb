#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/evaluation/report.h"
#include "apps/maps/map_straightness.h"
#include "data/core/math.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kAround_m = 0.15;
constexpr double kAcrossLayer_m = 0.075;              // the other face of a thin wall is further
constexpr double kStorey_m = 2.75;                    // that leaning is told for
constexpr double kMaxOffSquare_deg = 3, kNear_m = 1;  // of faces that an angle is between
constexpr size_t kLookedAt = 3000;
constexpr size_t kFewAround = 10, kManyAround = 600;

struct Layer {
  double mpv_m2 = kNoFigure, mme = kNoFigure;
};

// The variances of points about a place, ascending; the least as if there were endless of them.
std::optional<Vector3d> VariancesAround(const SurfaceMap& map, const std::vector<int>& found,
                                        const SurfaceCube& at) {
  if (found.size() < kFewAround) return std::nullopt;
  const size_t step = found.size() / kManyAround + 1;
  Vector3d mean = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();
  double count = 0;
  for (size_t i = 0; i < found.size(); i += step) {
    const Vector3d offset = map.points()[static_cast<size_t>(found[i])] - at.p;
    if (std::abs(at.normal.dot(offset)) > kAcrossLayer_m) continue;
    mean += offset;
    products += offset * offset.transpose();
    count += 1;
  }
  if (count < kFewAround) return std::nullopt;
  mean /= count;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(products / count - mean * mean.transpose());
  Vector3d variances = (solver.eigenvalues() * count / (count - 1)).cwiseMax(1e-12);
  variances[0] *= (count - 1) / (count - 3);
  return variances;
}

Layer MeasureLayer(const SurfaceMap& map) {
  std::vector<Eigen::Vector3f> places;
  if (map.points().empty()) return {};
  const Vector3d origin = map.points().front();
  for (const Vector3d& p : map.points()) places.push_back((p - origin).cast<float>());
  const PointTree tree(places);
  PointTree::Found found;
  const double radius_m = std::max(kAround_m, 2 * map.cube_m());
  const double two_pi_e = 2 * std::numbers::pi * std::numbers::e;
  double variances_m2 = 0, entropies = 0, count = 0;
  for (const size_t cube : map.SomePlanes(kLookedAt)) {
    const SurfaceCube& at = map.cubes()[cube];
    tree.FindWithin((at.p - origin).cast<float>(), radius_m, &found);
    const auto variances = VariancesAround(map, found.items, at);
    if (!variances) continue;
    variances_m2 += (*variances)[0];
    entropies += 0.5 * (3 * std::log(two_pi_e) + variances->array().log().sum());
    ++count;
  }
  if (count == 0) return {};
  return {variances_m2 / count, entropies / count};
}

// The stretch of a face along a direction, from a place.
Interval FindExtent(const FoundFace& face, const Vector3d& direction, const Vector3d& from,
                    const Vector3d& up) {
  const Vector3d half = 0.5 * face.length_m * up.cross(face.normal).normalized();
  const auto [from_m, to_m] = std::minmax(
      {direction.dot(face.middle - half - from), direction.dot(face.middle + half - from)});
  return {from_m, to_m};
}

// How far faces are from 90 degrees that are about so and within a metre of each other.
std::optional<double> FindOffSquare_deg(const FoundFace& a, const FoundFace& b,
                                        const Vector3d& up) {
  const auto level = [&](const Vector3d& n) { return Vector3d((n - up * up.dot(n)).normalized()); };
  const double off_rad = std::asin(level(a.normal).dot(level(b.normal)));
  if (std::abs(off_rad) > kMaxOffSquare_deg / kDegreesPerRadian) return std::nullopt;
  for (const auto& [face, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const Interval stretch = FindExtent(*face, other->normal, other->middle, up);
    if (stretch.from_m > kNear_m || stretch.to_m < -kNear_m) return std::nullopt;
  }
  return std::abs(off_rad) * kDegreesPerRadian;
}

double MeanSquareRoot(double squares, double weights) {
  return weights > 0 ? std::sqrt(squares / weights) : kNoFigure;
}

}  // namespace

std::vector<StraightedgeFigures> Summarize(
    const std::vector<std::vector<LaidStraightedge>>& pieces) {
  std::vector<StraightedgeFigures> figures;
  for (const double length_m : kMapStraightedges_m) {
    StraightedgeFigures all;
    all.length_m = length_m;
    double squares = 0;
    std::vector<double> gaps_m;
    for (const std::vector<LaidStraightedge>& piece : pieces) {
      for (const LaidStraightedge& laid : piece) {
        if (laid.length_m != length_m) continue;
        ++all.pieces;
        all.laid_m += laid.laid_m;
        squares += laid.laid_m * laid.rms_m * laid.rms_m;
        gaps_m.push_back(laid.gap_m);
        all.within_din += laid.gap_m <= AllowedGap_m(length_m);
      }
    }
    all.rms_m = MeanSquareRoot(squares, all.laid_m);
    all.gap_median_m = QuantileFigure(gaps_m, 0.5);
    all.gap_worst_m = QuantileFigure(gaps_m, 1);
    figures.push_back(all);
  }
  return figures;
}

WallStraightness MeasureWalls(const SurfaceMap& map, const BuildingAxes& axes,
                              const std::vector<FoundFace>& faces) {
  WallStraightness result;
  const Vector3d up = axes.axes.col(2);
  std::vector<std::vector<LaidStraightedge>> laid;
  double lean_squares = 0;
  for (const FoundFace& face : faces) {
    ++result.walls;
    result.length_m += face.length_m;
    const double area_m2 = face.length_m * face.height_m;
    result.area_m2 += area_m2;
    laid.push_back(LayStraightedges(face.samples, face.noise_m));
    const double lean_m = kStorey_m * std::asin(face.normal.dot(up));
    lean_squares += area_m2 * lean_m * lean_m;
  }
  result.straightedges = Summarize(laid);
  result.lean_rms_m = MeanSquareRoot(lean_squares, result.area_m2);
  result.tilt_deg = axes.is_z_up ? axes.tilt_deg : kNoFigure;
  double angle_squares = 0, legs_m = 0;
  for (size_t i = 0; i < faces.size(); ++i) {
    for (size_t j = i + 1; j < faces.size(); ++j) {
      const auto off_deg = FindOffSquare_deg(faces[i], faces[j], up);
      if (!off_deg) continue;
      const double leg_m = std::min(faces[i].length_m, faces[j].length_m);
      ++result.angles;
      angle_squares += leg_m * *off_deg * *off_deg;
      legs_m += leg_m;
    }
  }
  result.angle_rms_deg = MeanSquareRoot(angle_squares, legs_m);
  const Layer layer = MeasureLayer(map);
  result.thickness_m = std::sqrt(layer.mpv_m2);
  result.mme = layer.mme;
  return result;
}

}  // namespace slcmap::evaluation
