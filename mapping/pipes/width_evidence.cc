#include "mapping/pipes/width_evidence.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;

// Bodies as seen along an axis: how far the outline on one side of them (0, 1) is along a normal.
struct CylinderBody {
  static constexpr int kParameters = 3;  // place, radius
  template <typename T>
  static T Reach(const T* x, const Vector2d& normal, int side) {
    return normal.x() * x[0] + normal.y() * x[1] + (side == 0 ? -1.0 : 1.0) * x[2];
  }
};
struct EdgesBody {
  static constexpr int kParameters = 4;  // the places of both
  template <typename T>
  static T Reach(const T* x, const Vector2d& normal, int side) {
    return normal.x() * x[2 * side] + normal.y() * x[2 * side + 1];
  }
};
struct BarBody {
  static constexpr int kParameters = 4;  // place, half of its sizes
  template <typename T>
  static T Reach(const T* x, const Vector2d& normal, int side) {
    using std::abs;
    return normal.x() * x[0] + normal.y() * x[1] +
           (side == 0 ? -1.0 : 1.0) * (abs(normal.x() * x[2]) + abs(normal.y() * x[3]));
  }
};

// Its square is Cauchy's loss.
template <typename T>
T Robust(const T& sigmas) {
  constexpr double kHalf2 = 4, kTiny = 1e-12;  // where it counts half, squared
  using std::log;
  using std::sqrt;
  const T share = sigmas * sigmas / kHalf2 + kTiny;
  return sigmas * sqrt(log(1.0 + share) / share);
}

template <typename Body>
class Misfits {
 public:
  Misfits(const std::vector<OutlinePair>& pairs, double pose_sigma_m)
      : pairs_(pairs), pose_sigma_m_(pose_sigma_m) {}

  int NumResiduals() const { return 2 * static_cast<int>(pairs_.size()); }

  template <typename T>
  bool operator()(const T* x, T* residuals) const {
    for (const OutlinePair& pair : pairs_) {
      const T first = pair.offsets_m[0] - Body::Reach(x, pair.normals[0], 0);
      const T second = pair.offsets_m[1] - Body::Reach(x, pair.normals[1], 1);
      *residuals++ = Robust(T((second - first) / (M_SQRT2 * pair.sigma_m)));
      *residuals++ =
          Robust(T(0.5 * (first + second) / std::hypot(pair.sigma_m * M_SQRT1_2, pose_sigma_m_)));
    }
    return true;
  }

 private:
  const std::vector<OutlinePair>& pairs_;
  const double pose_sigma_m_;
};

template <typename Body>
using Parameters = Eigen::Matrix<double, Body::kParameters, 1>;

// Moves the body to where it fits best; how badly it fits there.
template <typename Body>
double Fit(const std::vector<OutlinePair>& pairs, double pose_sigma_m, Parameters<Body>* body) {
  using Function =
      ceres::TinySolverAutoDiffFunction<Misfits<Body>, Eigen::Dynamic, Body::kParameters>;
  const Misfits<Body> misfits(pairs, pose_sigma_m);
  const Function function(misfits);
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = 20;
  return 2 * solver.Solve(function, body).final_cost;
}

// On either side of the axis, as most cameras see it.
Parameters<EdgesBody> EdgesAside(const std::vector<OutlinePair>& pairs, double radius_m) {
  Vector2d aside = Vector2d::Zero();
  for (const OutlinePair& pair : pairs) aside += pair.normals[0] + pair.normals[1];
  aside = radius_m * (aside.norm() > 0 ? Vector2d(aside.normalized()) : Vector2d::UnitX());
  return {-aside.x(), -aside.y(), aside.x(), aside.y()};
}

// Flat ones, and square ones.
double FitBar(const std::vector<OutlinePair>& pairs, double radius_m, double pose_sigma_m) {
  constexpr double kThin = 0.2, kThick = 1;  // in radii
  double least = INFINITY;
  for (const double width : {kThin, kThick}) {
    for (const double depth : {kThin, kThick}) {
      Parameters<BarBody> bar(0, 0, width * radius_m, depth * radius_m);
      least = std::min(least, Fit<BarBody>(pairs, pose_sigma_m, &bar));
    }
  }
  return least;
}

}  // namespace

double ToldByWidths(const std::vector<OutlinePair>& pairs, double radius_m, double pose_sigma_m) {
  Parameters<EdgesBody> edges = EdgesAside(pairs, radius_m);
  return Fit<EdgesBody>(pairs, pose_sigma_m, &edges);
}

WidthEvidence WidthEvidenceOf(const std::vector<OutlinePair>& pairs, double radius_m,
                              double pose_sigma_m) {
  WidthEvidence evidence;
  evidence.images = static_cast<int>(pairs.size());
  if (pairs.size() < 2) return evidence;
  Parameters<CylinderBody> cylinder(0, 0, radius_m);
  evidence.cylinder = Fit<CylinderBody>(pairs, pose_sigma_m, &cylinder);
  evidence.radius_m = cylinder[2];
  Parameters<EdgesBody> edges = EdgesAside(pairs, radius_m);
  evidence.edges = Fit<EdgesBody>(pairs, pose_sigma_m, &edges);
  evidence.bar = FitBar(pairs, radius_m, pose_sigma_m);
  std::vector<OutlinePair> perfect = pairs;
  for (OutlinePair& pair : perfect) {
    for (int side = 0; side < 2; ++side) {
      pair.offsets_m[side] = CylinderBody::Reach(cylinder.data(), pair.normals[side], side);
    }
  }
  evidence.told = ToldByWidths(perfect, radius_m, pose_sigma_m);
  return evidence;
}

}  // namespace slcmap
