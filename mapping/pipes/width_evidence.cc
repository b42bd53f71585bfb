#include "mapping/pipes/width_evidence.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <algorithm>
#include <cmath>

#include "mapping/pipes/across_axis.h"

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
  static constexpr int kParameters = 5;  // place, half of its sizes, turn
  template <typename T>
  static T Reach(const T* x, const Vector2d& normal, int side) {
    using std::abs;
    using std::cos;
    using std::sin;
    const T c = cos(x[4]), s = sin(x[4]);
    const T half = abs((normal.x() * c + normal.y() * s) * x[2]) +
                   abs((normal.y() * c - normal.x() * s) * x[3]);
    return normal.x() * x[0] + normal.y() * x[1] + (side == 0 ? -1.0 : 1.0) * half;
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

// The place that most planes of a side pass through.
Vector2d NearestToAll(const std::vector<OutlinePair>& pairs, int side) {
  NearestPlace place;
  for (const OutlinePair& pair : pairs) {
    place.Add(pair.normals[side], pair.offsets_m[side], 1 / (pair.sigma_m * pair.sigma_m));
  }
  return place.Solve();
}

double FitEdges(const std::vector<OutlinePair>& pairs, double pose_sigma_m) {
  const Vector2d first = NearestToAll(pairs, 0), second = NearestToAll(pairs, 1);
  Parameters<EdgesBody> edges(first.x(), first.y(), second.x(), second.y());
  return Fit<EdgesBody>(pairs, pose_sigma_m, &edges);
}

// From flat ones and square ones, along the building and across.
double FitBar(const std::vector<OutlinePair>& pairs, double radius_m, double pose_sigma_m) {
  constexpr double kThin = 0.2, kThick = 1;  // in radii
  double least = INFINITY;
  for (const double width : {kThin, kThick}) {
    for (const double depth : {kThin, kThick}) {
      for (const double turn_rad : {0.0, M_PI_4}) {
        Parameters<BarBody> bar;
        bar << 0, 0, width * radius_m, depth * radius_m, turn_rad;
        least = std::min(least, Fit<BarBody>(pairs, pose_sigma_m, &bar));
      }
    }
  }
  return least;
}

}  // namespace

double ToldByWidths(const std::vector<OutlinePair>& pairs, double pose_sigma_m) {
  return FitEdges(pairs, pose_sigma_m);
}

WidthEvidence WidthEvidenceOf(const std::vector<OutlinePair>& pairs, double radius_m,
                              double pose_sigma_m) {
  WidthEvidence evidence;
  evidence.images = static_cast<int>(pairs.size());
  if (pairs.size() < 2) return evidence;
  Parameters<CylinderBody> cylinder(0, 0, radius_m);
  evidence.cylinder = Fit<CylinderBody>(pairs, pose_sigma_m, &cylinder);
  evidence.radius_m = cylinder[2];
  evidence.edges = FitEdges(pairs, pose_sigma_m);
  evidence.bar = FitBar(pairs, radius_m, pose_sigma_m);
  std::vector<OutlinePair> perfect = pairs;
  for (OutlinePair& pair : perfect) {
    for (int side = 0; side < 2; ++side) {
      pair.offsets_m[side] = CylinderBody::Reach(cylinder.data(), pair.normals[side], side);
    }
  }
  evidence.told = ToldByWidths(perfect, pose_sigma_m);
  return evidence;
}

}  // namespace slcmap
