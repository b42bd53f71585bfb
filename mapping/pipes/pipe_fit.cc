#include "mapping/pipes/pipe_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "data/io/yaml.h"
#include "mapping/lines/line_fit.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;
using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

constexpr int kSteps = 12;
constexpr double kMaxStep_m = 0.2;
constexpr double kLeastSine = 0.05;  // between ray and axis: others are along the pipe

struct Residual {
  double value_m = 0;
  Vector5d by;  // place across, direction, radius
};

// Nothing of a ray that runs along the axis.
std::optional<Residual> ComputeResidual(const Cylinder& cylinder,
                                        const Eigen::Matrix<double, 3, 2>& across, double side,
                                        const TangentRay& ray) {
  const Vector3d way = ray.centre_world - cylinder.axis.point_world;
  const Vector3d normal = ray.ray_world.cross(cylinder.axis.direction_world);
  const double sine = normal.norm();
  if (sine < kLeastSine) return std::nullopt;
  const double distance_m = way.dot(normal) / sine;
  Residual residual;
  residual.value_m = distance_m - side * cylinder.radius_m;
  for (int k = 0; k < 2; ++k) {
    const Vector3d turned = ray.ray_world.cross(across.col(k));
    residual.by[k] = -normal.dot(across.col(k)) / sine;
    residual.by[2 + k] = way.dot(turned) / sine - distance_m * normal.dot(turned) / (sine * sine);
  }
  residual.by[4] = -side;
  return residual;
}

std::vector<double> MeasureSides(const PointAndDirection& axis,
                                 const std::vector<TangentRay>& rays) {
  std::vector<double> sides;
  for (const TangentRay& ray : rays) sides.push_back(SignedDistance(axis, ray) < 0 ? -1 : 1);
  return sides;
}

struct NormalEquations {
  Matrix5d H = Matrix5d::Zero();
  Vector5d g = Vector5d::Zero();
  int rays = 0;
};

NormalEquations Sum(const PipeFit& fit, const std::vector<TangentRay>& rays,
                    const std::vector<double>& sides, const PipeFitOptions& options) {
  NormalEquations sums;
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto residual = ComputeResidual(fit.cylinder, fit.across, sides[i], rays[i]);
    if (!residual) continue;
    const double sigmas = residual->value_m / rays[i].sigma_m;
    const double robust = 1 / (1 + std::pow(sigmas / options.robust_sigmas, 2));
    const double weight = robust / (rays[i].sigma_m * rays[i].sigma_m);
    sums.H += weight * residual->by * residual->by.transpose();
    sums.g += weight * residual->value_m * residual->by;
    ++sums.rays;
  }
  return sums;
}

int CountImages(const std::vector<TangentRay>& rays) {
  std::set<int> images;
  for (const TangentRay& ray : rays) images.insert(ray.image);
  return static_cast<int>(images.size());
}

}  // namespace

double SignedDistance(const PointAndDirection& axis, const TangentRay& ray) {
  const Vector3d normal = ray.ray_world.cross(axis.direction_world);
  const double sine = std::max(normal.norm(), 1e-9);
  return (ray.centre_world - axis.point_world).dot(normal) / sine;
}

double OffTangent(const Cylinder& cylinder, const TangentRay& ray) {
  return std::abs(SignedDistance(cylinder.axis, ray)) - cylinder.radius_m;
}

double PipeFit::sigma_m() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>());
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

double PipeFit::radius_sigma_m() const { return std::sqrt(std::max(0.0, covariance(4, 4))); }

std::optional<PipeFit> FitPipe(const Cylinder& start, const std::vector<TangentRay>& rays,
                               const PipeFitOptions& options) {
  PipeFit fit;
  fit.cylinder = start;
  fit.images = CountImages(rays);
  const std::vector<double> sides = MeasureSides(start.axis, rays);
  const double held = 1 / (options.direction_rad * options.direction_rad);
  NormalEquations sums;
  for (int step = 0; step < kSteps; ++step) {
    PointAndDirection& axis = fit.cylinder.axis;
    fit.across = ComputeAcross(axis.direction_world);
    sums = Sum(fit, rays, sides, options);
    if (sums.rays < 5) return std::nullopt;
    sums.H.block<2, 2>(2, 2) += held * Eigen::Matrix2d::Identity();
    sums.g.segment<2>(2) +=
        held * fit.across.transpose() * (axis.direction_world - start.axis.direction_world);
    const Eigen::LDLT<Matrix5d> solver(sums.H);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
    const Vector5d delta = -solver.solve(sums.g);
    if (!delta.allFinite() || delta.head<2>().norm() > kMaxStep_m) return std::nullopt;
    axis.point_world += fit.across * delta.head<2>();
    axis.direction_world = (axis.direction_world + fit.across * delta.segment<2>(2)).normalized();
    fit.cylinder.radius_m += delta[4];
    if (delta.norm() < 1e-9) break;
  }
  const double shared = std::max(1.0, static_cast<double>(fit.images) / options.images_that_count);
  fit.covariance = shared * sums.H.inverse();
  if (!fit.covariance.allFinite() || fit.cylinder.radius_m <= 0) return std::nullopt;
  return fit;
}

namespace {

constexpr OptionTable kTable{
    Option{"find", &PipeOptions::find, false, true},
    Option{"min_radius_m", &PipeOptions::min_radius_m, 0.005, 10.0},
    Option{"min_outlined_radius_m", &PipeOptions::min_outlined_radius_m, 0.005, 10.0},
    Option{"max_radius_m", &PipeOptions::max_radius_m, 0.005, 10.0},
    Option{"min_length_m", &PipeOptions::min_length_m, 0.1, 100.0},
    Option{"sigma_px", &PipeOptions::sigma_px, 0.01, 10.0},
    Option{"pose_sigma_m", &PipeOptions::pose_sigma_m, 0.0, 1.0},
    Option{"max_turn_rad", &PipeOptions::max_turn_rad, 0.0, 0.5},
    Option{"max_off_sigmas", &PipeOptions::max_off_sigmas, 0.1, 100.0},
    Option{"min_touching", &PipeOptions::min_touching, 0.1, 1.0},
    Option{"min_both_sides", &PipeOptions::min_both_sides, 0.0, 1.0},
    Option{"min_gain", &PipeOptions::min_gain, 1.0, 100.0},
    Option{"max_surface_off", &PipeOptions::max_surface_off, 0.0, 1.0},
    Option{"max_outlined_off_m", &PipeOptions::max_outlined_off_m, 0.0, 1.0}};

}  // namespace

void PipeOptions::Check() const {
  kTable.Check("mapping.pipes", *this);
  if (max_radius_m < min_radius_m) {
    throw ConfigError("mapping.pipes.max_radius_m: expected at least min_radius_m");
  }
}

void PipeOptions::Read(YamlSection section) { kTable.Read(section, this); }

}  // namespace slcmap::mapping
