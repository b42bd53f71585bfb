#include "mapping/lines/line_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "data/core/math.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kRobustSigmas = 1;  // at which a place counts half (Cauchy)

constexpr int kFitSteps = 5;
constexpr int kFullSamples = 4;       // more that are near each other err alike
constexpr double kWeakSigma_rad = 1;  // of the direction of a line without a prior
constexpr double kMaxStep_m = 1;

// A place's distance from the line's image, and its derivative by the line's shift across at the
// place; nothing behind the camera.
struct Residual {
  double value_px = 0;
  Eigen::Vector2d by_shift;  // px / m
  double depth_m = 0;
};

std::optional<Residual> ComputeResidual(const EdgePoint& place, const Eigen::Vector3d& p_world,
                                        const Eigen::Matrix<double, 3, 2>& across,
                                        const ViewCameras& views) {
  const RigidTransform& T_camera_world = views.T_camera_world[place.view][place.camera];
  const Camera& camera = views.cameras[place.camera];
  const Eigen::Vector3d p = T_camera_world * p_world;
  if (p.z() < 0.05) return std::nullopt;
  const Eigen::Vector2d px = PixelFromPlane(camera, Eigen::Vector2d(p.hnormalized()));
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << camera.fx_px / p.z(), 0, -camera.fx_px * p.x() / (p.z() * p.z()), 0,
      camera.fy_px / p.z(), -camera.fy_px * p.y() / (p.z() * p.z());
  const Eigen::Matrix3d R = T_camera_world.rotation.toRotationMatrix();
  const Eigen::Vector2d normal = place.normal.cast<double>();
  return Residual{normal.dot(px - place.px.cast<double>()),
                  (normal.transpose() * by_point * R * across).transpose(), p.z()};
}

struct Sums {
  Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
  Eigen::Vector4d g = Eigen::Vector4d::Zero();
  std::vector<double> off_px;  // of the places, at least 0
};

int IntervalAt(const EdgePoint& place, const LineFitOptions& options) {
  return static_cast<int>(std::floor(place.along_m / options.stretch_m));
}

// How well the image knows each place: see LineFitOptions.
std::vector<double> ImageSigmas_px(const PointAndDirection& line,
                                   const std::vector<EdgePoint>& places, const ViewCameras& views,
                                   const LineFitOptions& options) {
  std::vector<double> distances_m;
  std::map<int, double> nearest_m;  // by interval
  for (const EdgePoint& place : places) {
    const Eigen::Vector3d p = line.point_world + place.along_m * line.direction_world;
    distances_m.push_back((p - views.Centre(place.view, place.camera)).norm());
    double& nearest =
        nearest_m.try_emplace(IntervalAt(place, options), distances_m.back()).first->second;
    nearest = std::min(nearest, distances_m.back());
  }
  double of_line_m = std::numeric_limits<double>::max();
  for (const auto& [index, distance_m] : nearest_m) of_line_m = std::min(of_line_m, distance_m);
  std::vector<double> sigmas_px;
  for (size_t i = 0; i < places.size(); ++i) {
    const double of_interval_m = nearest_m.at(IntervalAt(places[i], options));
    const double times_farther = distances_m[i] / of_interval_m *
                                 std::min(of_interval_m / of_line_m, options.most_times_farther);
    const double samples = std::min(places[i].samples, kFullSamples);
    sigmas_px.push_back(options.sigma_px * std::pow(times_farther, options.far_power) *
                        std::sqrt(kFullSamples / samples));
  }
  return sigmas_px;
}

// With the direction's derivative along `across`, counted from the middle of the line.
Sums SumPlaces(const PointAndDirection& line, const Eigen::Matrix<double, 3, 2>& across,
               const std::vector<EdgePoint>& places, const std::vector<double>& image_sigmas_px,
               const ViewCameras& views, double middle_m, const LineFitOptions& options) {
  Sums sums;
  for (size_t i = 0; i < places.size(); ++i) {
    const EdgePoint& place = places[i];
    const double along_m = place.along_m - middle_m;
    const Eigen::Vector3d p_world = line.point_world + along_m * line.direction_world;
    const auto residual = ComputeResidual(place, p_world, across, views);
    if (!residual) continue;
    const double focal_px = views.cameras[place.camera].fx_px;
    const double pose_px = focal_px * options.pose_sigma_m / residual->depth_m;
    const double sigma_px = std::hypot(image_sigmas_px[i], pose_px);
    const double sigmas = std::abs(residual->value_px) / sigma_px;
    const double robust = 1 / (1 + std::pow(sigmas / kRobustSigmas, 2));
    const double weight = robust / (sigma_px * sigma_px);
    Eigen::Vector4d J;
    J << residual->by_shift, along_m * residual->by_shift;
    sums.H += weight * J * J.transpose();
    sums.g += weight * residual->value_px * J;
    sums.off_px.push_back(std::abs(residual->value_px));
  }
  return sums;
}

void AddPrior(const PointAndDirection& line, const Eigen::Matrix<double, 3, 2>& across,
              const std::optional<DirectionPrior>& prior, Sums* sums) {
  if (!prior || prior->is_across) {
    sums->H.bottomRightCorner<2, 2>() +=
        Eigen::Matrix2d::Identity() / (kWeakSigma_rad * kWeakSigma_rad);
  }
  if (!prior) return;
  const double weight = 1 / (prior->sigma_rad * prior->sigma_rad);
  if (prior->is_across) {
    const Eigen::Vector2d by_turn = across.transpose() * prior->axis_world;
    sums->H.bottomRightCorner<2, 2>() += weight * by_turn * by_turn.transpose();
    sums->g.tail<2>() += weight * prior->axis_world.dot(line.direction_world) * by_turn;
    return;
  }
  sums->H.bottomRightCorner<2, 2>() += weight * Eigen::Matrix2d::Identity();
  const double sense = prior->axis_world.dot(line.direction_world) < 0 ? -1 : 1;
  const Eigen::Vector3d off = line.direction_world - sense * prior->axis_world;
  sums->g.tail<2>() += weight * across.transpose() * off;
}

double ComputeMiddle(const std::vector<EdgePoint>& places) {
  double sum = 0, count = 0;
  for (const EdgePoint& place : places) {
    sum += static_cast<double>(place.along_m) * place.samples;
    count += place.samples;
  }
  return count > 0 ? sum / count : 0;
}

double RootMeanSquare(const std::vector<double>& values) {
  double squared = 0;
  for (const double value : values) squared += value * value;
  return std::sqrt(squared / static_cast<double>(values.size()));
}

// How many places, in the mean, are of one interval in one image.
double PlacesAlike(const std::vector<EdgePoint>& places, const LineFitOptions& options) {
  std::set<std::tuple<int, int, int>> intervals;
  for (const EdgePoint& place : places) {
    intervals.insert({place.view, place.camera, IntervalAt(place, options)});
  }
  return static_cast<double>(places.size()) / static_cast<double>(intervals.size());
}

int CountViews(const std::vector<EdgePoint>& places) {
  std::vector<int> views;
  for (const EdgePoint& place : places) views.push_back(place.view);
  std::sort(views.begin(), views.end());
  return static_cast<int>(std::unique(views.begin(), views.end()) - views.begin());
}

}  // namespace

void AddPlaces(const std::vector<LineSample>& samples, const LineInView& line, int view, int camera,
               double step_m, std::vector<EdgePoint>* places) {
  const Eigen::Vector2d normal = Normal(line.px);
  EdgePoint place;
  Eigen::Vector2d px_sum = Eigen::Vector2d::Zero();
  double along_sum_m = 0;
  int64_t cell = 0;
  const auto finish = [&] {
    if (place.samples == 0) return;
    place.px = (px_sum / place.samples).cast<float>();
    place.along_m = static_cast<float>(along_sum_m / place.samples);
    // Doubling it, as vectors do, would waste a third of what places take, which is most of a map.
    if (places->size() == places->capacity()) places->reserve(places->size() * 5 / 4 + 16);
    places->push_back(place);
  };
  for (const LineSample& sample : samples) {
    if (!sample.is_edge) continue;
    const auto sample_cell = static_cast<int64_t>(std::floor(sample.along_m / step_m));
    if (place.samples == 0 || sample_cell != cell) {
      finish();
      place = {view, camera};
      place.normal = normal.cast<float>();
      place.from_m = static_cast<float>(sample.along_m - sample.reach_m);
      px_sum.setZero();
      along_sum_m = 0;
      cell = sample_cell;
    }
    px_sum += sample.px + sample.across_px * normal;
    along_sum_m += sample.along_m;
    place.to_m = static_cast<float>(sample.along_m + sample.reach_m);
    ++place.samples;
  }
  finish();
}

double LineFit::sigma_m() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>(),
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

double LineFit::SigmaTowards_m(const Eigen::Vector3d& way_world, double along_m) const {
  Eigen::Vector4d by_fit;
  by_fit << across.transpose() * way_world, along_m * across.transpose() * way_world;
  return std::sqrt(std::max(0.0, by_fit.dot(covariance * by_fit)));
}

std::optional<LineFit> FitLine(const PointAndDirection& start, const std::vector<EdgePoint>& places,
                               const ViewCameras& views, const std::optional<DirectionPrior>& prior,
                               const LineFitOptions& options) {
  LineFit fit;
  fit.views = CountViews(places);
  fit.shift_m = ComputeMiddle(places);
  fit.line = start;
  fit.line.point_world += fit.shift_m * start.direction_world;
  const std::vector<double> sigmas_px = ImageSigmas_px(start, places, views, options);
  const double shared = std::max(1.0, static_cast<double>(fit.views) / options.views_that_count);
  const double alike = shared * PlacesAlike(places, options);  // places and views that err as one
  Sums sums;
  Eigen::Matrix4d of_places = Eigen::Matrix4d::Zero();
  for (int step = 0; step < kFitSteps; ++step) {
    fit.across = ComputeAcross(fit.line.direction_world);
    sums = SumPlaces(fit.line, fit.across, places, sigmas_px, views, fit.shift_m, options);
    if (sums.off_px.size() < 4) return std::nullopt;
    sums.H /= alike;
    sums.g /= alike;
    of_places = sums.H;
    AddPrior(fit.line, fit.across, prior, &sums);
    const Eigen::LDLT<Eigen::Matrix4d> solver(sums.H);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
    const Eigen::Vector4d delta = -solver.solve(sums.g);
    if (!delta.allFinite() || delta.head<2>().norm() > kMaxStep_m) return std::nullopt;
    fit.line.point_world += fit.across * delta.head<2>();
    fit.line.direction_world =
        (fit.line.direction_world + fit.across * delta.tail<2>()).normalized();
    if (delta.norm() < 1e-6) break;
  }
  const Eigen::Matrix4d of_prior = sums.H - of_places;
  fit.covariance = shared * (alike * of_places + of_prior).inverse();
  fit.world_covariance = sums.H.inverse();
  fit.world_covariance.topLeftCorner<2, 2>().diagonal().array() +=
      options.shared_sigma_m * options.shared_sigma_m;
  fit.rms_px = RootMeanSquare(sums.off_px);
  fit.spread_px = ComputeSpread(std::move(sums.off_px));
  if (!fit.covariance.allFinite() || !fit.world_covariance.allFinite()) return std::nullopt;
  return fit;
}

double ComputeSpread(std::vector<double> distances_px) {
  return kSigmaOfMedian * Quantile(std::move(distances_px), 0.5);
}

std::vector<double> OffLine_px(const PointAndDirection& line, double shift_m,
                               const std::vector<EdgePoint>& places, const ViewCameras& views) {
  constexpr double kBehind_px = 1e6;
  const Eigen::Matrix<double, 3, 2> across = ComputeAcross(line.direction_world);
  std::vector<double> off_px;
  for (const EdgePoint& place : places) {
    const Eigen::Vector3d p_world =
        line.point_world + (place.along_m - shift_m) * line.direction_world;
    const auto residual = ComputeResidual(place, p_world, across, views);
    off_px.push_back(residual ? std::abs(residual->value_px) : kBehind_px);
  }
  return off_px;
}

}  // namespace slcmap::mapping
