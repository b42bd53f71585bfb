#include "tests/benchmarks/line_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr double kMinDepth_m = 0.1;
constexpr double kMinPlaneAngle_rad = 0.01;  // between the planes of two observations

// Distances of a segment's ends from the projected line through two points.
struct LineError {
  LineError(const Projector& projector, double focal_px, const View& view)
      : focal_px(focal_px),
        start(projector.Ray(view.px.start)),
        end(projector.Ray(view.px.end)),
        T_camera_world(view.T_world_camera.Inverse()) {}
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const Eigen::Matrix<T, 3, 3> R = T_camera_world.rotation.toRotationMatrix().cast<T>();
    const Eigen::Matrix<T, 3, 1> t = T_camera_world.translation.cast<T>();
    const Eigen::Matrix<T, 3, 1> p = R * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(a) + t;
    const Eigen::Matrix<T, 3, 1> q = R * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(b) + t;
    const Eigen::Matrix<T, 3, 1> n = p.cross(q);
    const T norm = sqrt(n[0] * n[0] + n[1] * n[1] + T(1e-12));
    residual[0] = T(focal_px) * n.dot(start.cast<T>()) / norm;
    residual[1] = T(focal_px) * n.dot(end.cast<T>()) / norm;
    return true;
  }
  double focal_px;
  Eigen::Vector3d start, end;
  RigidTransform T_camera_world;
};

}  // namespace

Eigen::Vector3d Projector::Ray(const Eigen::Vector2d& px) const {
  return {(px.x() - camera_.cx_px) / camera_.fx_px, (px.y() - camera_.cy_px) / camera_.fy_px, 1};
}

std::optional<LineSegment> Projector::Project(const RigidTransform& T_camera_world,
                                              const Segment3d& s) const {
  Eigen::Vector3d a = T_camera_world * s.a, b = T_camera_world * s.b;
  if (a.z() < kMinDepth_m && b.z() < kMinDepth_m) return std::nullopt;
  if (a.z() < kMinDepth_m) a += (kMinDepth_m - a.z()) / (b.z() - a.z()) * (b - a);
  if (b.z() < kMinDepth_m) b += (kMinDepth_m - b.z()) / (a.z() - b.z()) * (a - b);
  return Clip({Pixel(a), Pixel(b)});
}

Eigen::Vector2d Projector::Pixel(const Eigen::Vector3d& p) const {
  return {camera_.fx_px * p.x() / p.z() + camera_.cx_px,
          camera_.fy_px * p.y() / p.z() + camera_.cy_px};
}

// Liang and Barsky.
std::optional<LineSegment> Projector::Clip(const LineSegment& s) const {
  const Eigen::Vector2d d = s.end - s.start;
  double low = 0, high = 1;
  const double edges[][2] = {{-d.x(), s.start.x()},
                             {d.x(), camera_.width_px - 1 - s.start.x()},
                             {-d.y(), s.start.y()},
                             {d.y(), camera_.height_px - 1 - s.start.y()}};
  for (const auto& [p, q] : edges) {
    if (p == 0 && q < 0) return std::nullopt;
    if (p < 0) low = std::max(low, q / p);
    if (p > 0) high = std::min(high, q / p);
  }
  if (low >= high) return std::nullopt;
  return LineSegment{s.start + low * d, s.start + high * d};
}

std::optional<Segment3d> LineFitter::Fit(const std::vector<View>& views) const {
  auto line = Intersect(views);  // by consensus, as the loss below has local minima
  if (!line) return std::nullopt;
  ceres::Problem problem;
  for (const auto& view : views) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<LineError, 2, 3, 3>(
                                 new LineError(projector_, focal_px_, view)),
                             new ceres::CauchyLoss(0.5), line->a.data(), line->b.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 20;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return line;
}

std::array<double, 2> LineFitter::Errors_px(const Segment3d& line, const View& view) const {
  std::array<double, 2> errors;
  LineError(projector_, focal_px_, view)(line.a.data(), line.b.data(), errors.data());
  return errors;
}

Eigen::Vector3d LineFitter::Foot(const Segment3d& line, const View& view,
                                 const Eigen::Vector2d& px) const {
  const Eigen::Vector3d c = view.T_world_camera.translation;
  const Eigen::Vector3d r = (view.T_world_camera.rotation * projector_.Ray(px)).normalized();
  const Eigen::Vector3d d = (line.b - line.a).normalized();
  const Eigen::Vector3d n = r.cross(d.cross(r));
  return line.a + n.dot(c - line.a) / n.dot(d) * d;
}

Eigen::Vector3d LineFitter::PlaneNormal(const View& view) const {
  return (view.T_world_camera.rotation *
          projector_.Ray(view.px.start).cross(projector_.Ray(view.px.end)))
      .normalized();
}

// The intersection of two planes of observation; nothing where they are too much alike.
std::optional<Segment3d> LineFitter::Intersect(const View& a, const View& b) const {
  const Eigen::Vector3d n = PlaneNormal(a), m = PlaneNormal(b), d = n.cross(m);
  if (d.norm() < kMinPlaneAngle_rad) return std::nullopt;
  const Eigen::Vector3d c = a.T_world_camera.translation;
  Eigen::Matrix3d A;
  A << n.transpose(), m.transpose(), d.transpose();
  const Eigen::Vector3d p =
      A.inverse() * Eigen::Vector3d(n.dot(c), m.dot(b.T_world_camera.translation), d.dot(c));
  Segment3d line{p, p + d.normalized()};
  line = {Foot(line, a, a.px.start), Foot(line, a, a.px.end)};
  if (!line.a.allFinite() || !line.b.allFinite() || (line.a - line.b).norm() < 1e-3) {
    return std::nullopt;
  }
  return line;
}

// Of the pairs of observations the intersection that agrees with most.
std::optional<Segment3d> LineFitter::Intersect(const std::vector<View>& views) const {
  const size_t step = views.size() / 12 + 1;
  std::optional<Segment3d> best;
  double best_cost = 1e18;
  for (size_t i = 0; i < views.size(); i += step) {
    for (size_t j = i + 1; j < views.size(); j += step) {
      const auto line = Intersect(views[i], views[j]);
      if (!line) continue;
      double cost = 0;
      for (const auto& view : views) {
        for (const double e : Errors_px(*line, view)) cost += std::log1p(e * e);
      }
      if (cost >= best_cost) continue;
      best_cost = cost;
      best = line;
    }
  }
  return best;
}

}  // namespace slcmap
