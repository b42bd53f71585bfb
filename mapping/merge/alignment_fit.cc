#include "mapping/merge/alignment_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

// What samples are off by besides what is known of them, and how many neighbours share that.
constexpr double kSurfaceSigma_m = 0.02, kLineSigma_m = 0.005;
constexpr double kSharedBy = 10;
constexpr int kLeastMatches = 30;
// Of the information on the transform: least against most, so that nothing slides.
constexpr double kLeastInformation = 1e-4;
constexpr double kTypicalReach_m = 5;  // by which turns are compared with shifts

// Normal equations in turn about z (about a centre) and translation.
class LevelEquations {
 public:
  LevelEquations(const RigidTransform& T, const Eigen::Vector3d& centre) : T_(T), centre_(centre) {}

  // Where a point of the second should be moved by `off` along a unit direction.
  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& along, double off_m, double sigma_m) {
    const double r = off_m / sigma_m;
    const double weight = 1 / ((1 + r * r) * sigma_m * sigma_m * kSharedBy);
    Eigen::Vector4d jacobian;
    const Eigen::Vector3d moved = Eigen::Vector3d::UnitZ().cross(p - centre_) / kTypicalReach_m;
    jacobian << along.dot(moved), along;
    information_ += weight * jacobian * jacobian.transpose();
    gradient_ += weight * off_m * jacobian;
  }

  std::optional<RigidTransform> Solve() const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(information_,
                                                                Eigen::EigenvaluesOnly);
    if (!(solver.eigenvalues()(0) > kLeastInformation * solver.eigenvalues()(3))) {
      return std::nullopt;
    }
    const Eigen::Vector4d step = information_.ldlt().solve(gradient_);
    const RigidTransform about = LevelTransform(step(0) / kTypicalReach_m, Eigen::Vector3d::Zero());
    const Eigen::Vector3d t = about * (T_.translation - centre_) + centre_ + step.tail<3>();
    return RigidTransform((about.rotation * T_.rotation).normalized(), t);
  }

 private:
  const RigidTransform& T_;
  const Eigen::Vector3d centre_;
  Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient_ = Eigen::Vector4d::Zero();
};

void AddSurfaces(const FeatureIndex& first, const std::vector<SurfaceSample>& samples,
                 const RigidTransform& T, double gate_m, int max_samples, AlignmentFit* fit,
                 LevelEquations* equations) {
  const std::size_t step = 1 + samples.size() / max_samples;
  double squares_m2 = 0;
  for (std::size_t i = 0; i < samples.size(); i += step) {
    const Eigen::Vector3d p = T * samples[i].p_world;
    const auto* match = first.SurfaceNear(p, T.rotation * samples[i].normal_world, gate_m);
    if (!match) continue;
    const double off_m = match->normal_world.dot(match->p_world - p);
    equations->Add(p, match->normal_world, off_m, kSurfaceSigma_m);
    squares_m2 += off_m * off_m;
    ++fit->surfaces;
  }
  fit->surface_rms_m = std::sqrt(squares_m2 / std::max(1, fit->surfaces));
}

void AddLines(const FeatureIndex& first, const std::vector<LinePlace>& places,
              const RigidTransform& T, double gate_m, int max_samples, AlignmentFit* fit,
              LevelEquations* equations) {
  const std::size_t step = 1 + places.size() / max_samples;
  double squares_m2 = 0;
  for (std::size_t i = 0; i < places.size(); i += step) {
    const Eigen::Vector3d p = T * places[i].p_world;
    const auto* match = first.LineNear(p, T.rotation * places[i].direction_world, gate_m);
    if (!match) continue;
    const Eigen::Vector3d& along = match->direction_world;
    const Eigen::Vector3d way = match->p_world - p, off = way - way.dot(along) * along;
    const double sigma_m = std::sqrt(std::pow(match->sigma_m, 2) + std::pow(places[i].sigma_m, 2) +
                                     kLineSigma_m * kLineSigma_m);
    const Eigen::Vector3d across = along.unitOrthogonal(), other = along.cross(across);
    equations->Add(p, across, across.dot(off), sigma_m);
    equations->Add(p, other, other.dot(off), sigma_m);
    squares_m2 += off.squaredNorm();
    ++fit->lines;
  }
  fit->line_rms_m = std::sqrt(squares_m2 / std::max(1, fit->lines));
}

Eigen::Vector3d CentreOf(const AlignmentFeatures& features) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceSample& surface : features.surfaces) sum += surface.p_world;
  for (const LinePlace& place : features.lines) sum += place.p_world;
  const std::size_t count = features.surfaces.size() + features.lines.size();
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

}  // namespace

std::optional<AlignmentFit> FitAlignment(const FeatureIndex& first, const AlignmentFeatures& second,
                                         const RigidTransform& start,
                                         const AlignmentFitOptions& options) {
  AlignmentFit fit{start};
  const Eigen::Vector3d centre = CentreOf(second);
  for (int step = 0; step < options.steps; ++step) {
    const double share = static_cast<double>(step) / std::max(1, options.steps - 1);
    const double gate_m = options.from_m * std::pow(options.to_m / options.from_m, share);
    AlignmentFit next{fit.T_first_second};
    LevelEquations equations(fit.T_first_second, fit.T_first_second * centre);
    AddSurfaces(first, second.surfaces, fit.T_first_second, gate_m, options.max_samples, &next,
                &equations);
    AddLines(first, second.lines, fit.T_first_second, gate_m, options.max_samples, &next,
             &equations);
    if (next.surfaces + next.lines < kLeastMatches) return std::nullopt;
    const auto moved = equations.Solve();
    if (!moved) return std::nullopt;
    next.T_first_second = *moved;
    fit = next;
  }
  return fit;
}

}  // namespace slcmap
