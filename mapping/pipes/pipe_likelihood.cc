#include "mapping/pipes/pipe_likelihood.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "mapping/lines/line_fit.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPoseSigma_m = 0.001;  // of images against each other, near a place
// More images of one place share their errors; as do more points.
constexpr double kImagesThatCount = 30, kPointsThatCount = 20;
constexpr double kRobustSigmas = 2;  // at which a sight counts half (Cauchy)

// Outlines of an image are off by what its pose is off, in common: rows of covariance
// sigma^2 I + pose^2 1 1^T are brought to unit covariance.
void Whiten(const std::vector<TangentLine>& tangents, MatrixXd* A, VectorXd* b) {
  for (Eigen::Index from = 0, to = 0; from < std::ssize(tangents); from = to) {
    while (to < std::ssize(tangents) && tangents[to].image == tangents[from].image) ++to;
    const Eigen::Index rows = to - from;
    const double sigma_m = tangents[from].sigma_m;
    const double shared =
        1 - sigma_m / std::hypot(sigma_m, std::sqrt(static_cast<double>(rows)) * kPoseSigma_m);
    const Eigen::RowVectorXd mean = A->middleRows(from, rows).colwise().mean();
    A->middleRows(from, rows).rowwise() -= shared * mean;
    b->segment(from, rows).array() -= shared * b->segment(from, rows).mean();
    A->middleRows(from, rows) /= sigma_m;
    b->segment(from, rows) /= sigma_m;
  }
}

int CountImages(const std::vector<TangentLine>& tangents) {
  int images = 0;
  for (size_t i = 0; i < tangents.size(); ++i) {
    images += i == 0 || tangents[i].image != tangents[i - 1].image;
  }
  return images;
}

// A body whose outlines are linear in its parameters (m): places and sizes.
struct BodyFit {
  VectorXd x;
  MatrixXd information;
  double log_evidence = 0;
};

// `derive` is the row of what a tangent's offset changes by with the parameters, of which nothing
// is known but that they are about as large as `scale_m`.
template <typename Derive>
BodyFit FitBody(const std::vector<TangentLine>& tangents, int size, double scale_m,
                const Derive& derive) {
  constexpr int kRounds = 6;
  MatrixXd A(std::ssize(tangents), size);
  VectorXd b(std::ssize(tangents));
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    A.row(i) = derive(tangents[i]).transpose();
    b[i] = tangents[i].offset_m;
  }
  Whiten(tangents, &A, &b);
  const double shared = std::min(1.0, kImagesThatCount / std::max(1, CountImages(tangents)));
  const double held = 1 / (scale_m * scale_m);
  BodyFit fit;
  fit.x = VectorXd::Zero(size);
  Eigen::LDLT<MatrixXd> solver;
  VectorXd shares = VectorXd::Ones(b.size());
  for (int round = 0; round < kRounds; ++round) {
    fit.information = shared * A.transpose() * shares.asDiagonal() * A;
    fit.information.diagonal().array() += held;
    solver.compute(fit.information);
    fit.x = solver.solve(shared * A.transpose() * shares.asDiagonal() * b);
    shares = ((A * fit.x - b) / kRobustSigmas).array().square();
    shares = 1 / (1 + shares.array());
  }
  const double misfit = -shared * kRobustSigmas * kRobustSigmas * shares.array().log().sum();
  const double volume = (solver.vectorD().array() / held).log().sum();
  fit.log_evidence = -0.5 * (misfit + held * fit.x.squaredNorm() + volume);
  return fit;
}

VectorXd DeriveCylinder(const TangentLine& tangent) {
  return Vector3d(tangent.normal.x(), tangent.normal.y(), tangent.side);
}

// An edge that stays where it is, on each side. Not of each outline: poses that drift by some
// millimetres while one is followed move it, as they move no cylinder that all of them touch.
BodyFit FitStrip(const std::vector<TangentLine>& tangents, double scale_m) {
  return FitBody(tangents, 4, scale_m, [](const TangentLine& tangent) {
    VectorXd row = VectorXd::Zero(4);
    row.segment<2>(tangent.side < 0 ? 0 : 2) = tangent.normal;
    return row;
  });
}

// A rectangle whose first side is turned like `u`: its place, and half of its sides.
BodyFit FitBar(const std::vector<TangentLine>& tangents, const Vector2d& u, double scale_m) {
  const Vector2d v(-u.y(), u.x());
  return FitBody(tangents, 4, scale_m, [&](const TangentLine& tangent) -> VectorXd {
    return Eigen::Vector4d(tangent.normal.x(), tangent.normal.y(),
                           tangent.side * std::abs(tangent.normal.dot(u)),
                           tangent.side * std::abs(tangent.normal.dot(v)));
  });
}

}  // namespace

double PipeFit::sigma_m() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>());
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

double PipeFit::radius_sigma_m() const { return std::sqrt(std::max(0.0, covariance(2, 2))); }

std::optional<PipeFit> FitPipe(const PointAndDirection& start,
                               const std::vector<const Outline*>& outlines) {
  constexpr double kAnywhere_m = 1;
  const auto across = ComputeAcross(start.direction_world);
  const std::vector<TangentLine> tangents = FindTangents(start, across, outlines);
  const BodyFit fit = FitBody(tangents, 3, kAnywhere_m, &DeriveCylinder);
  if (!fit.x.allFinite() || fit.x[2] <= 0) return std::nullopt;
  PipeFit pipe;
  pipe.cylinder = {{start.point_world + across * fit.x.head<2>(), start.direction_world}, fit.x[2]};
  pipe.covariance = fit.information.inverse();
  std::map<int, std::pair<bool, bool>> sides;
  for (const TangentLine& tangent : tangents) {
    (tangent.side < 0 ? sides[tangent.image].first : sides[tangent.image].second) = true;
  }
  pipe.images = static_cast<int>(sides.size());
  for (const auto& [image, seen] : sides) pipe.both_images += seen.first && seen.second;
  return pipe;
}

double TouchingShare(const Cylinder& cylinder, const Outline& outline) {
  constexpr double kMostSigmas = 6;
  const auto across = ComputeAcross(cylinder.axis.direction_world);
  const auto touches = [&](const TangentLine& tangent) {
    return std::abs(std::abs(tangent.offset_m) - cylinder.radius_m) <=
           kMostSigmas * std::hypot(tangent.sigma_m, kPoseSigma_m);
  };
  return static_cast<double>(
             std::ranges::count_if(FindTangents(cylinder.axis, across, {&outline}), touches)) /
         static_cast<double>(outline.sights.size());
}

namespace {

// A point of the cloud as seen along an axis, which is at the origin.
struct SurfacePlace {
  Vector2d place;
  double sigma_m = 0;
};

// Points between the outlines, and beside them, as the views see them.
struct SurfacesAbout {
  std::vector<SurfacePlace> between, beside;
};

constexpr double kBetween = 0.8, kBesideFrom = 1.25, kBesideTo = 2.5;  // aside, in radii
constexpr double kFarthest = 1.5, kNearest = 2;                        // behind and before the axis

// Towards the views, unless they are all around.
std::optional<Vector2d> WayToViews(const std::vector<TangentLine>& tangents) {
  constexpr double kOneSide = 0.85;  // of the mean of unit vectors
  Vector2d mean = Vector2d::Zero();
  for (const TangentLine& tangent : tangents) mean += tangent.to_camera;
  mean /= static_cast<double>(tangents.size());
  if (mean.norm() < kOneSide) return std::nullopt;
  return mean.normalized();
}

SurfacesAbout CollectSurfaces(const Cylinder& cylinder, const Interval& interval,
                              const std::optional<Vector2d>& to_views, const IndexedCloud& cloud) {
  constexpr double kPiece_m = 0.5;
  const PointAndDirection& axis = cylinder.axis;
  const auto across = ComputeAcross(axis.direction_world);
  const double reach_m = 3 * cylinder.radius_m;
  const int pieces = std::max(1, static_cast<int>(std::ceil(interval.length_m() / kPiece_m)));
  const double step_m = interval.length_m() / pieces;
  SurfacesAbout surfaces;
  PointTree::Found found;
  for (int piece = 0; piece < pieces; ++piece) {
    const double start_m = interval.from_m + piece * step_m;
    const Vector3d middle = axis.point_world + (start_m + 0.5 * step_m) * axis.direction_world;
    cloud.index.FindWithin(middle.cast<float>(), std::hypot(0.5 * step_m, reach_m), &found);
    for (const int i : found.items) {
      const DensePoint& point = cloud.points[i];
      const Vector3d way = point.p_world - axis.point_world;
      const double along_m = axis.direction_world.dot(way) - start_m;
      if (along_m < 0 || along_m >= step_m) continue;
      const Vector2d place = across.transpose() * way;
      // Normals look at the views that saw a point.
      const Vector2d facing =
          to_views ? *to_views : Vector2d((across.transpose() * point.normal_world).normalized());
      const double height = place.dot(facing) / cylinder.radius_m;
      const double aside =
          std::abs(facing.x() * place.y() - facing.y() * place.x()) / cylinder.radius_m;
      if (height > kNearest) continue;
      if (aside > kBesideFrom && aside < kBesideTo) {
        surfaces.beside.push_back({place, point.sigma_m});
      } else if (aside < kBetween && height > -kFarthest) {
        surfaces.between.push_back({place, point.sigma_m});
      }
    }
  }
  return surfaces;
}

constexpr double kStray = 0.1;  // of points: anywhere

// How much likelier points are at a surface than anywhere about the cylinder.
template <typename Distance>
double CompareSurface(const std::vector<SurfacePlace>& points, double radius_m,
                      const Distance& distance_m) {
  constexpr double kOff_m = 0.006, kOff = 0.1;  // of clouds, about thin things and round ones
  const double range_m = (kNearest + kFarthest) * radius_m;
  double sum = 0;
  for (const SurfacePlace& point : points) {
    const double sigma_m = std::hypot(point.sigma_m, kOff_m + kOff * radius_m);
    const double sigmas = distance_m(point.place) / sigma_m;
    const double density =
        std::exp(-0.5 * sigmas * sigmas) / (std::sqrt(2 * std::numbers::pi) * sigma_m);
    sum += std::log((1 - kStray) * density * range_m + kStray);
  }
  return sum * std::min(1.0, kPointsThatCount / std::max(1.0, static_cast<double>(points.size())));
}

// The plane that lies nearest to all of the points.
Eigen::Hyperplane<double, 2> FitPlane(const std::vector<SurfacePlace>& points) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) places.col(static_cast<int>(i)) = points[i].place;
  const Vector2d mean = places.rowwise().mean();
  places.colwise() -= mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(places * places.transpose());
  return {solver.eigenvectors().col(0), mean};
}

// A strip is on the plane that the cloud has there, as far as images let its edges be: they know
// the depth of each less well than its direction, and than the cloud does.
double CompareStrip(const BodyFit& strip, const SurfacesAbout& surfaces, double radius_m) {
  constexpr double kLeastSigma_m = 0.01;  // of an edge from a cloud
  std::vector<SurfacePlace> all = surfaces.between;
  all.insert(all.end(), surfaces.beside.begin(), surfaces.beside.end());
  if (all.size() < 3) return 0;  // they have any plane
  const auto plane = FitPlane(all);
  const auto off_m = [&](const Vector2d& place) { return plane.signedDistance(place); };
  const MatrixXd covariance = strip.information.inverse();
  double squared_sigmas = 0;
  for (const int edge : {0, 2}) {
    const double variance = plane.normal().dot(covariance.block<2, 2>(edge, edge) * plane.normal());
    squared_sigmas +=
        std::pow(off_m(strip.x.segment<2>(edge)), 2) / (variance + kLeastSigma_m * kLeastSigma_m);
  }
  return CompareSurface(surfaces.between, radius_m, off_m) +
         CompareSurface(surfaces.beside, radius_m, off_m) - 0.5 * squared_sigmas;
}

// The best bar of any turn, which bulges from the cloud as a pipe does: only outlines tell them.
double CompareBars(const std::vector<TangentLine>& tangents, double radius_m) {
  constexpr int kTurns = 9;  // of a quarter
  double best = -1e9;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double turn_rad = 0.5 * std::numbers::pi * turn / kTurns;
    const Vector2d u(std::cos(turn_rad), std::sin(turn_rad));
    best = std::max(best, FitBar(tangents, u, radius_m).log_evidence);
  }
  return best - std::log(kTurns);
}

}  // namespace

double ComputePipeLogRatio(const Cylinder& cylinder, const Interval& interval,
                           const std::vector<const Outline*>& outlines, const IndexedCloud& cloud) {
  const double radius_m = cylinder.radius_m;
  const auto tangents =
      FindTangents(cylinder.axis, ComputeAcross(cylinder.axis.direction_world), outlines);
  const SurfacesAbout surfaces = CollectSurfaces(cylinder, interval, WayToViews(tangents), cloud);
  const BodyFit round = FitBody(tangents, 3, radius_m, &DeriveCylinder);
  const BodyFit strip = FitStrip(tangents, radius_m);
  const double bulges = CompareSurface(surfaces.between, radius_m, [&](const Vector2d& place) {
    return (place - round.x.head<2>()).norm() - round.x[2];
  });
  const double flat = std::max(0.0, CompareStrip(strip, surfaces, radius_m));
  return round.log_evidence -
         std::max(strip.log_evidence + flat - bulges, CompareBars(tangents, radius_m));
}

}  // namespace slcmap::mapping
