#include "mapping/control/triangulation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFits_px = 4;
constexpr double kLeastDepth_m = 0.1;
constexpr double kPoseSigma_m =
    0.002;  // of neighbouring poses against each other, whatever images say
constexpr double kMostSigma_m = 0.1;

// A sighting with where its camera was.
struct PlacedSight {
  RigidTransform T_camera_world;
  Vector2d on_plane = Vector2d::Zero();
  double focal_px = 0, sigma_px = 0;

  Vector3d Centre() const { return T_camera_world.Inverse().translation; }
  Vector3d Direction() const {
    return (T_camera_world.rotation.conjugate() * on_plane.homogeneous()).normalized();
  }
  // In px; far off behind the camera.
  Vector2d Off(const Vector3d& p_world) const {
    const Vector3d p = T_camera_world * p_world;
    if (p.z() < kLeastDepth_m) return Vector2d::Constant(1e6);
    return focal_px * (p.hnormalized() - on_plane);
  }
};
using PlacedSights = std::vector<PlacedSight>;

// Nearest to all rays; nothing where they are as good as parallel.
std::optional<Vector3d> NearestToRays(const PlacedSights& sights) {
  constexpr double kLeastAngle_rad = 0.005;
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const PlacedSight& sight : sights) {
    const Vector3d d = sight.Direction();
    const Matrix3d across = Matrix3d::Identity() - d * d.transpose();
    normal += across;
    right += across * sight.Centre();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(normal);
  const double least = solver.eigenvalues()[0] / static_cast<double>(sights.size());
  if (!(least > kLeastAngle_rad * kLeastAngle_rad / 4)) return std::nullopt;
  return normal.ldlt().solve(right);
}

PlacedSights ThoseThatFit(const PlacedSights& sights, const Vector3d& p_world) {
  PlacedSights fit;
  std::ranges::copy_if(sights, std::back_inserter(fit), [&](const PlacedSight& sight) {
    return sight.Off(p_world).norm() < kFits_px * std::max(1.0, sight.sigma_px);
  });
  return fit;
}

// The place of two rays that most fit.
PlacedSights LargestAgreement(const PlacedSights& sights) {
  constexpr size_t kMostTried = 40;
  const size_t step = std::max<size_t>(1, sights.size() / kMostTried);
  PlacedSights best;
  for (size_t i = 0; i < sights.size(); i += step) {
    for (size_t j = i + 1; j < sights.size(); j += step) {
      const auto p = NearestToRays({sights[i], sights[j]});
      PlacedSights fit = p ? ThoseThatFit(sights, *p) : PlacedSights();
      if (fit.size() > best.size()) best = std::move(fit);
    }
  }
  return best;
}

// Half the squared residuals' Hessian at a place, and the step to where it is least.
struct LinearStep {
  Matrix3d hessian = Matrix3d::Zero();
  Vector3d step = Vector3d::Zero();
  double chi2 = 0;
};

LinearStep StepFrom(const PlacedSights& sights, const Vector3d& p_world) {
  LinearStep out;
  Vector3d gradient = Vector3d::Zero();
  for (const PlacedSight& sight : sights) {
    const Vector3d p = sight.T_camera_world * p_world;
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
    by_point = (sight.focal_px / sight.sigma_px * by_point *
                sight.T_camera_world.rotation.toRotationMatrix())
                   .eval();
    const Vector2d off = sight.Off(p_world) / sight.sigma_px;
    out.hessian += by_point.transpose() * by_point;
    gradient += by_point.transpose() * off;
    out.chi2 += off.squaredNorm();
  }
  out.step = -out.hessian.ldlt().solve(gradient);
  return out;
}

std::optional<PlacedPoint> PlacePoint(const PlacedSights& all) {
  constexpr int kSteps = 8;
  PlacedSights sights = LargestAgreement(all);
  if (sights.size() < 2) return std::nullopt;
  auto p_world = NearestToRays(sights);
  if (!p_world) return std::nullopt;
  LinearStep last;
  for (int i = 0; i < kSteps; ++i) {
    if (PlacedSights fit = ThoseThatFit(all, *p_world); fit.size() >= 2) sights = std::move(fit);
    last = StepFrom(sights, *p_world);
    if (!last.step.allFinite()) return std::nullopt;
    *p_world += last.step;
  }
  const auto views = static_cast<double>(sights.size());
  const double scatter = std::max(1.0, last.chi2 / std::max(1.0, 2 * views - 3));
  const double least = Eigen::SelfAdjointEigenSolver<Matrix3d>(last.hessian).eigenvalues()[0];
  const double sigma_m = std::hypot(std::sqrt(scatter / least), kPoseSigma_m);
  if (!(sigma_m < kMostSigma_m)) return std::nullopt;
  return PlacedPoint{*p_world, sigma_m, static_cast<int>(sights.size())};
}

}  // namespace

std::optional<Vector2d> SightingCameras::OnPlane(const Sighting& sighting) const {
  const auto camera = static_cast<size_t>(sighting.camera);
  const auto ray = raw.cameras[camera].Unproject(sighting.px);
  if (!ray) return std::nullopt;
  const Vector3d turned = rectified.T_imu_camera[camera].rotation.conjugate() *
                          (raw.T_imu_camera[camera].rotation * *ray);
  if (turned.z() < kLeastDepth_m) return std::nullopt;
  return turned.hnormalized();
}

Rig CamerasOfMap(const Rig& given, const std::optional<Rig>& calibrated) {
  Rig rig = given;
  if (!calibrated) return rig;
  rig.cameras = calibrated->cameras;
  for (size_t i = 1; i < rig.cameras.size(); ++i) {
    rig.T_imu_camera[i] = given.T_imu_camera[0] *
                          (calibrated->T_imu_camera[0].Inverse() * calibrated->T_imu_camera[i]);
  }
  return rig;
}

std::map<std::string, PlacedPoint> Triangulate(
    const std::vector<Sighting>& sightings, const SightingCameras& cameras,
    const std::unordered_map<int64_t, RigidTransform>& T_world_imu) {
  std::map<std::string, PlacedSights> by_name;
  for (const Sighting& sighting : sightings) {
    const auto pose = T_world_imu.find(sighting.stamp_ns);
    const auto on_plane = cameras.OnPlane(sighting);
    if (pose == T_world_imu.end() || !on_plane) continue;
    const auto camera = static_cast<size_t>(sighting.camera);
    by_name[sighting.name].push_back(
        {(pose->second * cameras.rectified.T_imu_camera[camera]).Inverse(), *on_plane,
         cameras.rectified.cameras[camera].fx_px, sighting.sigma_px});
  }
  std::map<std::string, PlacedPoint> placed;
  for (const auto& [name, sights] : by_name) {
    if (const auto point = PlacePoint(sights)) placed.emplace(name, *point);
  }
  return placed;
}

}  // namespace slcmap::mapping
