#include "data/check/view_geometry.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/core/math.h"
#include "data/core/rigid_transform.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

constexpr int kMinPoints = 25;
constexpr int kTurnIterations = 6, kTryIterations = 4, kIterations = 10;
constexpr double kMinNoise_rad = 1e-4;  // a twentieth of a pixel
constexpr double kOutlier = 4;          // times the noise
constexpr double kConverged_rad = 1e-7;

struct Pose {
  Eigen::Quaterniond R_first_second = Eigen::Quaterniond::Identity();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

double CauchyWeight(double residual, double scale) {
  const double u = residual / scale;
  return 1 / (1 + u * u);
}

// Scale of residuals, of which some are wrong.
double Noise_rad(std::vector<double> residuals_rad) {
  for (double& residual_rad : residuals_rad) residual_rad = std::abs(residual_rad);
  return std::max(kMinNoise_rad, kSigmaOfMedian * Median(std::move(residuals_rad)));
}

// The rotation that explains the rays best if the camera did not move.
Eigen::Quaterniond TurnAlone(const std::vector<RayPair>& rays) {
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  for (int iteration = 0; iteration < kTurnIterations; ++iteration) {
    std::vector<double> residuals_rad;
    for (const RayPair& ray : rays) residuals_rad.push_back((ray.first - R * ray.second).norm());
    const double scale_rad = Noise_rad(residuals_rad);
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < rays.size(); ++i) {
      const double weight = CauchyWeight(residuals_rad[i], scale_rad);
      // first - R Exp(d) second ~ e + R [second]x d
      const Eigen::Matrix3d J = Skew(rays[i].second);
      const Eigen::Vector3d e = R.conjugate() * rays[i].first - rays[i].second;
      H += weight * J.transpose() * J;
      g -= weight * J.transpose() * e;
    }
    const Eigen::Vector3d step = H.ldlt().solve(g);
    if (!step.allFinite()) break;
    R = (R * ExpRotation(step)).normalized();
  }
  return R;
}

Eigen::Matrix<double, 3, 2> MakeTangentBasis(const Eigen::Vector3d& direction) {
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.cross(Eigen::Vector3d::Unit(least)).normalized();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

struct Solution {
  Pose pose;
  Matrix5d information = Matrix5d::Zero();  // for a noise of 1 rad
  double noise_rad = 0;
  double cost = 0;
  int points = 0;
};

// Residuals, normal equations and cost at a pose, with a noise that is given or, where that is 0,
// estimated.
Vector5d Linearise(const std::vector<RayPair>& rays, double noise_rad, Solution* solution) {
  const auto tangent = MakeTangentBasis(solution->pose.direction);
  std::vector<Epipolar> epipolars;
  std::vector<double> residuals_rad;
  for (const RayPair& ray : rays) {
    epipolars.push_back(
        ComputeEpipolar(ray, solution->pose.R_first_second, solution->pose.direction));
    residuals_rad.push_back(epipolars.back().residual_rad);
  }
  solution->noise_rad = noise_rad > 0 ? noise_rad : Noise_rad(residuals_rad);
  solution->information.setZero();
  solution->cost = 0;
  solution->points = 0;
  Vector5d gradient = Vector5d::Zero();
  for (const Epipolar& epipolar : epipolars) {
    const double u = epipolar.residual_rad / (2 * solution->noise_rad);
    const double weight = 1 / (1 + u * u);
    Vector5d jacobian;
    jacobian << epipolar.turn_jacobian, tangent.transpose() * epipolar.direction_jacobian;
    solution->information += weight * jacobian * jacobian.transpose();
    gradient += weight * jacobian * epipolar.residual_rad;
    solution->cost += std::log1p(u * u);
    solution->points += std::abs(epipolar.residual_rad) < kOutlier * solution->noise_rad;
  }
  return gradient;
}

Solution Minimise(const std::vector<RayPair>& rays, const Pose& start, int iterations,
                  double noise_rad) {
  Solution solution;
  solution.pose = start;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const Vector5d gradient = Linearise(rays, noise_rad, &solution);
    // The direction is undetermined where the camera only turned.
    Matrix5d damped = solution.information;
    damped.diagonal().tail<2>().array() += 1e-9 + 1e-3 * damped.diagonal().tail<2>().mean();
    damped.diagonal().head<3>().array() += 1e-9;
    const Vector5d step = -damped.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    const auto tangent = MakeTangentBasis(solution.pose.direction);
    Eigen::Vector2d slide = step.tail<2>();
    if (slide.norm() > 0.5) slide *= 0.5 / slide.norm();
    solution.pose.R_first_second =
        (solution.pose.R_first_second * ExpRotation(step.head<3>())).normalized();
    solution.pose.direction = (solution.pose.direction + tangent * slide).normalized();
    if (step.head<3>().norm() < kConverged_rad) break;
  }
  Linearise(rays, noise_rad, &solution);
  return solution;
}

// The direction that is nearest to all epipolar planes.
Eigen::Vector3d CommonDirection(const std::vector<RayPair>& rays, const Eigen::Quaterniond& R) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const RayPair& ray : rays) {
    const Eigen::Vector3d normal = ray.first.cross(R * ray.second);
    sum += normal * normal.transpose() / (normal.squaredNorm() + 1e-6);
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
}

}  // namespace

Epipolar ComputeEpipolar(const RayPair& rays, const Eigen::Quaterniond& R_first_second,
                         const Eigen::Vector3d& direction) {
  const Eigen::Vector3d second = R_first_second * rays.second;
  const Eigen::Vector3d normal_first = direction.cross(second);
  const Eigen::Vector3d normal_second = rays.first.cross(direction);
  const double size = std::sqrt(normal_first.squaredNorm() + normal_second.squaredNorm() + 1e-12);
  return {rays.first.dot(normal_first) / size,
          rays.second.cross(R_first_second.conjugate() * normal_second) / size,
          second.cross(rays.first) / size};
}

std::optional<TwoViewMotion> SolveTwoView(const std::vector<RayPair>& rays,
                                          const Eigen::Vector3d& guess) {
  if (rays.size() < kMinPoints) return std::nullopt;
  const Eigen::Quaterniond R = TurnAlone(rays);
  Solution best;
  double noise_rad = 0;  // that of the first, so that costs can be compared
  for (const Eigen::Vector3d& direction :
       {guess, CommonDirection(rays, R), Eigen::Vector3d(Eigen::Vector3d::UnitX()),
        Eigen::Vector3d(Eigen::Vector3d::UnitY()), Eigen::Vector3d(Eigen::Vector3d::UnitZ())}) {
    const Solution solution = Minimise(rays, {R, direction}, kTryIterations, noise_rad);
    if (noise_rad == 0 || solution.cost < best.cost) best = solution;
    if (noise_rad == 0) {
      noise_rad = solution.noise_rad;
      best = Minimise(rays, solution.pose, 0, noise_rad);
    }
  }
  best = Minimise(rays, best.pose, kIterations, 0);
  if (best.points < kMinPoints) return std::nullopt;
  TwoViewMotion motion;
  motion.R_first_second = best.pose.R_first_second;
  motion.direction = best.pose.direction;
  motion.noise_rad = best.noise_rad;
  Eigen::Matrix2d direction = best.information.bottomRightCorner<2, 2>();
  direction.diagonal().array() += 1e-9;  // undetermined where the camera only turned
  const Eigen::Matrix3d information =
      best.information.topLeftCorner<3, 3>() - best.information.topRightCorner<3, 2>() *
                                                   direction.inverse() *
                                                   best.information.bottomLeftCorner<2, 3>();
  motion.covariance = information.inverse() * best.noise_rad * best.noise_rad;
  return motion;
}

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

namespace {

constexpr float kSameFocal = 0.05F;

cv::Mat FilledUp(const cv::Mat& image, const cv::Size& size) {
  if (image.empty() || image.size() == size) return image;
  cv::Mat filled;
  cv::copyMakeBorder(image, filled, 0, size.height - image.rows, 0, size.width - image.cols,
                     cv::BORDER_REPLICATE);
  return filled;
}

}  // namespace

LikeLeft::LikeLeft(const Rig& rig) {
  const Camera &left = rig.cameras[0], &right = rig.cameras[1];
  if (right.width_px <= 0) return;
  const auto focal = static_cast<float>(left.MiddleFocal_px() / right.MiddleFocal_px());
  if (std::abs(focal - 1) > kSameFocal) scale_ = focal;
  const auto scaled = [&](int px) {
    return static_cast<int>(std::ceil(scale_ * static_cast<float>(px)));
  };
  scaled_ = cv::Size(scaled(right.width_px), scaled(right.height_px));
  filled_ =
      cv::Size(std::max(scaled_.width, left.width_px), std::max(scaled_.height, left.height_px));
}

cv::Mat LikeLeft::Left(const cv::Mat& left) const { return FilledUp(left, filled_); }

cv::Mat LikeLeft::Right(const cv::Mat& right) const {
  if (scale_ == 1 || right.empty()) return FilledUp(right, filled_);
  const cv::Matx23f map(scale_, 0, 0.5F * (scale_ - 1), 0, scale_, 0.5F * (scale_ - 1));
  cv::Mat blurred = right, scaled;
  if (scale_ < 1) cv::GaussianBlur(right, blurred, cv::Size(), 0.5 / scale_);
  cv::warpAffine(blurred, scaled, map, scaled_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return FilledUp(scaled, filled_);
}

cv::Point2f LikeLeft::FromRight(const cv::Point2f& px) const {
  if (scale_ == 1) return px;
  return scale_ * (px + cv::Point2f(0.5F, 0.5F)) - cv::Point2f(0.5F, 0.5F);
}

cv::Point2f LikeLeft::ToRight(const cv::Point2f& px) const {
  if (scale_ == 1) return px;
  return (px + cv::Point2f(0.5F, 0.5F)) / scale_ - cv::Point2f(0.5F, 0.5F);
}

}  // namespace slcmap::data
