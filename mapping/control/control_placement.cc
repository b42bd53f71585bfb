#include "mapping/control/control_placement.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "data/core/error.h"
#include "data/core/math.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matches = std::vector<ControlMatch>;

// Points that agree are so near at first: what is known of them, and how a map may be bent.
constexpr double kNear_m = 0.05, kNearShare = 0.002;
constexpr double kMostSigmas = 4;
constexpr double kLeastApart_m = 0.5;  // of points that tell a turn

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double AngleBetween(const Vector2d& from, const Vector2d& to) {
  return std::atan2(Cross(from, to), from.dot(to));
}

// The place at which two points lie best; nothing where they are too near, or as far from each
// other as they cannot be.
std::optional<Georeference> PlaceOfPair(const ControlMatch& a, const ControlMatch& b,
                                        double scale) {
  const Vector2d mapped = scale * (b.p_world - a.p_world).head<2>(),
                 given = (b.p_m - a.p_m).head<2>();
  if (mapped.norm() < kLeastApart_m || given.norm() < kLeastApart_m) return std::nullopt;
  Georeference place{.crs = "", .turn_rad = AngleBetween(mapped, given), .scale = scale};
  place.origin_m = 0.5 * (a.p_m + b.p_m) - place * (0.5 * (a.p_world + b.p_world));
  return place;
}

bool IsNear(const ControlMatch& match, const Georeference& place, double extent_m) {
  const Vector3d off = place * match.p_world - match.p_m;
  return (off.cwiseAbs() - kMostSigmas * match.sigma_m).maxCoeff() <
         kNear_m + kNearShare * extent_m;
}

double FindExtent(const Matches& matches) {
  Eigen::AlignedBox3d box;
  for (const ControlMatch& match : matches) box.extend(match.p_world);
  return box.isEmpty() ? 0 : box.sizes().norm();
}

struct PlaceCandidate {
  Georeference place;
  std::ptrdiff_t count = 0;
};

// The place of the pair that most points are near to.
PlaceCandidate FindCandidate(const Matches& matches, double scale) {
  const double extent_m = FindExtent(matches);
  PlaceCandidate best;
  double least_m = INFINITY;
  for (size_t i = 0; i < matches.size(); ++i) {
    for (size_t j = i + 1; j < matches.size(); ++j) {
      const auto place = PlaceOfPair(matches[i], matches[j], scale);
      if (!place) continue;
      std::ptrdiff_t count = 0;
      double sum_m = 0;
      for (const ControlMatch& match : matches) {
        if (!IsNear(match, *place, extent_m)) continue;
        ++count;
        sum_m += (*place * match.p_world - match.p_m).norm();
      }
      if (count < best.count || (count == best.count && sum_m >= least_m)) continue;
      best = {*place, count};
      least_m = sum_m;
    }
  }
  return best;
}

// One step of least squares in turn and shift; exact but for the turn, so that few suffice.
void Improve(const Matches& matches, const std::vector<double>& shares, Georeference* place) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (size_t i = 0; i < matches.size(); ++i) {
    if (shares[i] == 0) continue;
    const Vector3d mapped = *place * matches[i].p_world, arm = mapped - place->origin_m;
    Eigen::Matrix<double, 3, 4> by_place;
    by_place << Eigen::Matrix3d::Identity(), Vector3d(-arm.y(), arm.x(), 0);
    const Eigen::Vector3d weights = shares[i] * matches[i].sigma_m.cwiseAbs2().cwiseInverse();
    normal += by_place.transpose() * weights.asDiagonal() * by_place;
    right += by_place.transpose() * weights.asDiagonal() * (matches[i].p_m - mapped);
  }
  const Eigen::Vector4d step = normal.ldlt().solve(right);
  place->origin_m += step.head<3>();
  place->turn_rad = std::remainder(place->turn_rad + step[3], 2 * M_PI);
}

double MostSigmas(const ControlMatch& match, const Georeference& place) {
  return (place * match.p_world - match.p_m).cwiseQuotient(match.sigma_m).cwiseAbs().maxCoeff();
}

// Residuals scatter so much more than is known of them; less is chance.
double ScatterByMedian(const Matches& matches, const std::vector<bool>& fits,
                       const Georeference& place) {
  constexpr double kMedianOfThree = 1.42;  // of the largest of three normal deviates
  std::vector<double> sigmas;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (fits[i]) sigmas.push_back(MostSigmas(matches[i], place));
  }
  return std::max(1.0, Quantile(std::move(sigmas), 0.5) / kMedianOfThree);
}

// How long the map is against the ground, by the points that fit.
void FitScale(const Matches& matches, ControlPlacement* placement) {
  Vector2d middle = Vector2d::Zero(), middle_m = Vector2d::Zero();
  double count = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!placement->fits[i]) continue;
    middle += (placement->place * matches[i].p_world).head<2>();
    middle_m += matches[i].p_m.head<2>();
    ++count;
  }
  middle /= count;
  middle_m /= count;
  double along = 0, squares = 0, variance_m2 = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!placement->fits[i]) continue;
    const Vector2d mapped = (placement->place * matches[i].p_world).head<2>() - middle;
    along += mapped.dot(matches[i].p_m.head<2>() - middle_m);
    squares += mapped.squaredNorm();
    variance_m2 += matches[i].sigma_m.head<2>().squaredNorm() / (2 * count);
  }
  placement->map_scale = squares / along;
  placement->map_scale_sigma = placement->scatter * std::sqrt(variance_m2 / squares);
}

Matches Swapped(Matches matches) {
  for (ControlMatch& match : matches) std::swap(match.p_m.x(), match.p_m.y());
  return matches;
}

// By which distances between given points are longer than those of the map, in the middle, and how
// far from it quarters of them are.
struct DistanceRatio {
  double middle = 1, spread = 0;
};

DistanceRatio CompareDistances(const Matches& matches) {
  std::vector<double> ratios;
  for (size_t i = 0; i < matches.size(); ++i) {
    for (size_t j = i + 1; j < matches.size(); ++j) {
      const double mapped_m = (matches[j].p_world - matches[i].p_world).norm();
      if (mapped_m < kLeastApart_m) continue;
      ratios.push_back((matches[j].p_m - matches[i].p_m).norm() / mapped_m);
    }
  }
  if (ratios.empty()) return {};
  const double middle = Quantile(ratios, 0.5);
  return {middle, (Quantile(ratios, 0.75) - Quantile(ratios, 0.25)) / middle};
}

void RefuseDegrees(const std::string& path, const Matches& matches) {
  constexpr double kMostSpan = 0.1;
  const DistanceRatio ratio = CompareDistances(matches);
  Eigen::AlignedBox2d box;
  for (const ControlMatch& match : matches) box.extend(match.p_m.head<2>());
  const bool are_degrees = box.max().maxCoeff() <= 180 && box.min().minCoeff() >= -180 &&
                           box.sizes().maxCoeff() < kMostSpan &&
                           FindExtent(matches) > kLeastApart_m && !box.isEmpty() &&
                           ratio.middle < 0.5;
  if (!are_degrees) return;
  const ControlMatch& first = matches.front();
  throw DataError(fmt::format(
      "{}: point '{}': found {}, {}, which look like degrees, expected easting and northing in "
      "metres: give coordinates in a projected system, such as the UTM zone's, and name it with "
      "--crs",
      path, first.name, first.p_m.x(), first.p_m.y()));
}

void RefuseSwapped(const std::string& path, const Matches& matches, double scale,
                   std::ptrdiff_t count) {
  const PlaceCandidate swapped = FindCandidate(Swapped(matches), scale);
  if (matches.size() < 3 || swapped.count < 3 || swapped.count <= count) return;
  const ControlMatch& first = matches.front();
  throw DataError(fmt::format(
      "{}: point '{}': found easting {:.3f} and northing {:.3f}, with which {} of {} points fit "
      "the "
      "map, and with these swapped {}: expected x to the east and y to the north; swap the "
      "columns, or turn the sign of one",
      path, first.name, first.p_m.x(), first.p_m.y(), count, matches.size(), swapped.count));
}

// The point that is farthest from where the others have it.
std::string DescribeWorst(const Matches& matches, const Georeference& place) {
  const auto worst = std::ranges::max_element(matches, {}, [&](const ControlMatch& match) {
    return (place * match.p_world - match.p_m).norm();
  });
  return fmt::format("'{}' by {:.2f} m", worst->name, (place * worst->p_world - worst->p_m).norm());
}

[[noreturn]] void RefusePoints(const std::string& path, const Matches& matches,
                               const PlaceCandidate& best) {
  constexpr double kAnotherUnit = 0.05, kAlike = 0.02;
  const DistanceRatio ratio = CompareDistances(matches);
  if (matches.size() > 2 && std::abs(ratio.middle - 1) > kAnotherUnit && ratio.spread < kAlike) {
    throw DataError(fmt::format(
        "{}: found points, such as '{}', {:.4f} times as far from each other as the map has them, "
        "expected metres: are they in another unit, or another system?",
        path, matches.front().name, ratio.middle));
  }
  std::vector<std::string> names;
  for (const ControlMatch& match : matches) names.push_back(match.name);
  throw DataError(fmt::format(
      "{}: found that {} of {} points that the map has agree with it ({}{}), expected more than "
      "half, and two at least, half a metre apart: are names, coordinates and marks right?",
      path, best.count, matches.size(), fmt::join(names, ", "),
      best.count > 0 ? "; farthest off is " + DescribeWorst(matches, best.place) : ""));
}

}  // namespace

ControlPlacement PlaceOnPoints(const std::string& path, const std::vector<ControlMatch>& given,
                               double scale) {
  constexpr int kRounds = 10;
  Matches matches = given;
  const Vector3d near = matches.empty() ? Vector3d(0, 0, 0) : matches.front().p_m;
  RefuseDegrees(path, matches);
  for (ControlMatch& match : matches) match.p_m -= near;  // so that no digits are lost
  const PlaceCandidate best = FindCandidate(matches, scale);
  RefuseSwapped(path, given, scale, best.count);
  const auto size = std::ssize(matches);
  if (best.count < 2 || (size > 2 && 2 * best.count <= size)) RefusePoints(path, matches, best);
  ControlPlacement placement{best.place, {}};
  const double extent_m = FindExtent(matches);
  for (const ControlMatch& match : matches) {
    placement.fits.push_back(IsNear(match, best.place, extent_m));
  }
  // One that is wrong bends a fit of least squares, and hides in it: the farther off a point is
  // beside the others, the less it counts, until it is told which do not fit. Three do not tell.
  std::vector<double> shares(placement.fits.begin(), placement.fits.end());
  for (int i = 0; i < kRounds; ++i) {
    Improve(matches, shares, &placement.place);
    placement.scatter = ScatterByMedian(matches, placement.fits, placement.place);
    for (size_t k = 0; k < matches.size(); ++k) {
      const double times = MostSigmas(matches[k], placement.place) / placement.scatter;
      if (size > 3 && placement.fits[k]) shares[k] = 1 / (1 + times * times);
    }
  }
  for (size_t k = 0; k < matches.size(); ++k) {
    placement.fits[k] = MostSigmas(matches[k], placement.place) < kMostSigmas * placement.scatter;
    shares[k] = placement.fits[k] ? 1 : 0;
  }
  const auto fit = std::ranges::count(placement.fits, true);
  if (fit < 2 || (size > 2 && 2 * fit <= size)) {
    RefusePoints(path, matches, {placement.place, fit});
  }
  for (int i = 0; i < 2; ++i) Improve(matches, shares, &placement.place);
  FitScale(matches, &placement);
  placement.place.origin_m += near;
  return placement;
}

namespace {

struct Ratio {
  double times = 1, sigma = 0;  // given over mapped

  double Weight() const { return 1 / (sigma * sigma); }
};

// The median by weights, whose sum is given.
double FindMiddle(std::vector<Ratio> ratios, double weight) {
  std::ranges::sort(ratios, {}, &Ratio::times);
  double sum = 0;
  for (const Ratio& ratio : ratios) {
    sum += ratio.Weight();
    if (sum >= 0.5 * weight) return ratio.times;
  }
  return 1;
}

void AddRatio(const PlacedPoint& from, const PlacedPoint& to, double given_m, double sigma_m,
              std::vector<Ratio>* ratios) {
  const double mapped_m = (to.p_world - from.p_world).norm();
  constexpr double kLeastTelling_m = 1;
  if (mapped_m < kLeastTelling_m) return;
  const double all_m = std::hypot(sigma_m, from.sigma_m, to.sigma_m);
  ratios->push_back({given_m / mapped_m, all_m / mapped_m});
}

// Each point counts once, in however many pairs it is.
void AddPairsOfPoints(const Control& control, const std::map<std::string, PlacedPoint>& placed,
                      double grid_scale, std::vector<Ratio>* ratios) {
  std::vector<const ControlPoint*> seen;
  for (const ControlPoint& point : control.points) {
    if (placed.contains(point.name)) seen.push_back(&point);
  }
  if (seen.size() < 3) return;
  const double repeats = std::sqrt(std::max(1.0, static_cast<double>(seen.size()) / 2));
  for (size_t i = 0; i < seen.size(); ++i) {
    for (size_t j = i + 1; j < seen.size(); ++j) {
      Eigen::Vector3d apart_m = seen[j]->p_m - seen[i]->p_m;
      apart_m.head<2>() /= grid_scale;
      const double sigma_m = std::hypot(seen[i]->sigma_m.maxCoeff(), seen[j]->sigma_m.maxCoeff());
      const size_t before = ratios->size();
      AddRatio(placed.at(seen[i]->name), placed.at(seen[j]->name), apart_m.norm(), sigma_m, ratios);
      if (ratios->size() > before) ratios->back().sigma *= repeats;
    }
  }
}

}  // namespace

std::optional<MeasuredScale> MeasureScale(const Control& control,
                                          const std::map<std::string, PlacedPoint>& placed,
                                          double grid_scale) {
  constexpr double kOfMedian = 1.25;  // how much worse a median is known than a mean
  std::vector<Ratio> ratios;
  for (const KnownDistance& known : control.distances) {
    const auto from = placed.find(known.from), to = placed.find(known.to);
    if (from == placed.end() || to == placed.end()) continue;
    AddRatio(from->second, to->second, known.metres, known.sigma_m, &ratios);
  }
  AddPairsOfPoints(control, placed, grid_scale, &ratios);
  if (ratios.empty()) return std::nullopt;
  std::vector<double> off;
  double weight = 0;
  for (const Ratio& ratio : ratios) weight += ratio.Weight();
  const double middle = FindMiddle(ratios, weight);
  for (const Ratio& ratio : ratios) off.push_back(std::abs(ratio.times - middle) / ratio.sigma);
  const double scatter = std::max(1.0, kSigmaOfMedian * Quantile(off, 0.5));
  return MeasuredScale{middle, kOfMedian * scatter / std::sqrt(weight)};
}

void ScaleRun(double times, OdometryRun* run) {
  constexpr double kForgotten = 10;
  const auto scale_cameras = [times](Rig* rig) {
    const Eigen::Vector3d first = rig->T_imu_camera[0].translation;
    for (RigidTransform& T : rig->T_imu_camera) {
      T.translation = first + times * (T.translation - first);
    }
  };
  scale_cameras(&run->rectified_rig);
  if (run->source) scale_cameras(&run->source->raw_rig);
  const Eigen::Vector3d lever_m = run->rectified_rig.T_imu_camera[0].translation;
  const auto scale_pose = [&](RigidTransform* T) {
    T->translation = times * T->translation + (times - 1) * (T->rotation * lever_m);
  };
  for (OnlineState& state : run->states) {
    scale_pose(&state.T_world_imu);
    state.velocity_world_m_s *= times;
  }
  for (Keyframe& keyframe : run->keyframes) scale_pose(&keyframe.T_world_imu);
  for (Landmark& landmark : run->landmarks) {
    landmark.p_world *= times;
    if (landmark.sigma_m < kUnknownSigma_m) landmark.sigma_m *= times;
  }
  for (Line& line : run->lines) {
    line.start_world *= times;
    line.end_world *= times;
    line.covariance_m2 *= times * times;
  }
  if (run->calibration.empty()) return;
  // What the accelerometer seemed to be off by.
  CalibrationEstimate& found = run->calibration.back();
  found.imu_errors.segment<3>(kErrorAccelScale).setZero();
  found.imu_errors_sigma.segment<3>(kErrorAccelScale) *= kForgotten;
}

}  // namespace slcmap::mapping
