#include "data/check/placed_view.h"

#include <Eigen/Dense>
#include <cmath>

#include "data/asl_files.h"

namespace slcmap {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr size_t kPlacedMinPoints = 20;
constexpr double kPlacedMinAgree = 0.5;  // share of the points
constexpr int kPlacedIterations = 12;
constexpr double kPlacedMinNoise_rad = 1e-4, kFirstNoise_rad = 0.01;
constexpr double kPlacedOutlier = 4;     // times the noise
constexpr double kMedianToSigma = 0.85;  // of the length of a vector of two
constexpr double kConverged = 1e-8;
constexpr double kMinDistance_m = 0.05;

struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double noise_rad = 0;
  size_t agree = 0;
};

struct Linear {
  Eigen::Matrix<double, 3, 6> jacobian;  // rotation, translation
  Eigen::Vector3d residual;              // across the ray
};

Linear Linearise(const PlacedRay& ray, const RigidTransform& T_first_second) {
  const Eigen::Matrix3d R_second_first = T_first_second.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d q = R_second_first * (ray.p_first - T_first_second.translation);
  const double distance_m = std::max(kMinDistance_m, q.norm());
  const Eigen::Matrix3d across =
      (Eigen::Matrix3d::Identity() - ray.second * ray.second.transpose()) / distance_m;
  Linear linear;
  linear.residual = across * q;
  linear.jacobian.leftCols<3>() = across * Skew(q);
  linear.jacobian.rightCols<3>() = -across * R_second_first;
  return linear;
}

Normal NormalEquations(const std::vector<PlacedRay>& rays, const RigidTransform& T_first_second,
                       double least_noise_rad) {
  std::vector<Linear> linears;
  std::vector<double> sizes;
  for (const PlacedRay& ray : rays) {
    linears.push_back(Linearise(ray, T_first_second));
    sizes.push_back(linears.back().residual.norm());
  }
  Normal normal;
  normal.noise_rad = std::max(least_noise_rad, kMedianToSigma * Median(sizes));
  for (size_t i = 0; i < linears.size(); ++i) {
    const double u = sizes[i] / (2 * normal.noise_rad), weight = 1 / (1 + u * u);
    normal.H += weight * linears[i].jacobian.transpose() * linears[i].jacobian;
    normal.g -= weight * linears[i].jacobian.transpose() * linears[i].residual;
    normal.agree += sizes[i] < kPlacedOutlier * normal.noise_rad;
  }
  return normal;
}

}  // namespace

std::optional<PlacedMotion> SolvePlaced(const std::vector<PlacedRay>& rays,
                                        const RigidTransform& guess, bool fixed_rotation) {
  if (rays.size() < kPlacedMinPoints) return std::nullopt;
  PlacedMotion motion;
  RigidTransform& T = motion.T_first_second;
  T = guess;
  for (int iteration = 0; iteration < kPlacedIterations; ++iteration) {
    // Far off at first, few may seem to agree.
    const Normal normal =
        NormalEquations(rays, T, iteration < 3 ? kFirstNoise_rad : kPlacedMinNoise_rad);
    Vector6d step = Vector6d::Zero();
    if (fixed_rotation) {
      step.tail<3>() = normal.H.bottomRightCorner<3, 3>().ldlt().solve(normal.g.tail<3>());
    } else {
      step = normal.H.ldlt().solve(normal.g);
    }
    if (!step.allFinite()) return std::nullopt;
    T.rotation = (T.rotation * ExpRotation(step.head<3>())).normalized();
    T.translation += step.tail<3>();
    if (step.norm() < kConverged && iteration > 3) break;
  }
  const Normal normal = NormalEquations(rays, T, kPlacedMinNoise_rad);
  if (normal.agree < kPlacedMinPoints ||
      static_cast<double>(normal.agree) < kPlacedMinAgree * static_cast<double>(rays.size())) {
    return std::nullopt;
  }
  const Matrix6d covariance = normal.H.inverse() * normal.noise_rad * normal.noise_rad;
  motion.noise_rad = normal.noise_rad;
  motion.rotation_covariance = covariance.topLeftCorner<3, 3>();
  motion.translation_covariance = covariance.bottomRightCorner<3, 3>();
  return motion;
}

}  // namespace slcmap
