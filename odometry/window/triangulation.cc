#include "odometry/window/triangulation.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// One view of the point: p_camera ~ ray + lambda * offset, measured on z = 1.
struct View {
  Vector3d ray, offset;
  Vector2d measured;
};

std::vector<View> ViewsOf(const PointLandmark& landmark, const StereoGeometry& geometry) {
  std::vector<View> views;
  const RigidTransform T_world_host = landmark.host()->T_world_imu() * geometry.T_imu_camera[0];
  const Vector2d left = landmark.host()->measurements.at(landmark.id).left;
  const Vector3d ray = geometry.OnTruePlane(0, left).homogeneous();
  for (const FrameState* frame : landmark.frames) {
    const StereoMeasurement& measurement = frame->measurements.at(landmark.id);
    const RigidTransform T_imu_world = frame->T_world_imu().Inverse();
    for (int c = 0; c < 2; ++c) {
      if (c == 0 && frame == landmark.host()) continue;
      if (c == 1 && !measurement.right) continue;
      const RigidTransform T = geometry.T_imu_camera[c].Inverse() * T_imu_world * T_world_host;
      views.push_back({T.rotation * ray, T.translation,
                       geometry.OnTruePlane(c, c == 0 ? measurement.left : *measurement.right)});
    }
  }
  return views;
}

// (u x (ray + lambda offset)) = 0, summed over the views; and the largest angle between the rays.
double LinearInverseDepth(const std::vector<View>& views, double* parallax_rad) {
  double numerator = 0, denominator = 0;
  *parallax_rad = 0;
  for (const View& view : views) {
    const Vector3d u(view.measured.x(), view.measured.y(), 1);
    const Vector3d a = u.cross(view.ray), b = u.cross(view.offset);
    numerator -= a.dot(b);
    denominator += b.squaredNorm();
    *parallax_rad = std::max(*parallax_rad, std::atan2(a.norm(), u.dot(view.ray)));
  }
  return denominator > 0 ? numerator / denominator : 0;
}

struct Fit {
  double step = 0, squared_error = 0;
  bool in_front = true;
};

// One Gauss-Newton step on the reprojections.
Fit FitStep(const std::vector<View>& views, double inverse_depth) {
  double gradient = 0, hessian = 0;
  Fit fit;
  for (const View& view : views) {
    const Vector3d p = view.ray + inverse_depth * view.offset;
    if (p.z() < 0.02) {
      fit.in_front = false;
      return fit;
    }
    const Vector2d on_plane = p.head<2>() / p.z();
    const Vector2d r = on_plane - view.measured;
    const Vector2d j = (view.offset.head<2>() - on_plane * view.offset.z()) / p.z();
    gradient += j.dot(r);
    hessian += j.squaredNorm();
    fit.squared_error += r.squaredNorm();
  }
  fit.step = hessian > 0 ? -gradient / hessian : 0;
  return fit;
}

}  // namespace

std::optional<double> TriangulateInverseDepth(const PointLandmark& landmark,
                                              const StereoGeometry& geometry,
                                              const PointTriangulationOptions& options) {
  const std::vector<View> views = ViewsOf(landmark, geometry);
  if (views.empty()) return std::nullopt;
  double parallax_rad = 0;
  double inverse_depth = LinearInverseDepth(views, &parallax_rad);
  if (parallax_rad < options.min_parallax_rad) return std::nullopt;
  const double low = 1.0 / options.max_depth_m, high = 1.0 / options.min_depth_m;
  for (int i = 0; i < 3; ++i) {
    inverse_depth = std::clamp(inverse_depth, low, high);
    const Fit fit = FitStep(views, inverse_depth);
    if (!fit.in_front) return std::nullopt;
    inverse_depth += fit.step;
  }
  if (!(inverse_depth > low && inverse_depth < high)) return std::nullopt;
  const Fit fit = FitStep(views, inverse_depth);
  const double rms_sigma =
      geometry.weight * std::sqrt(fit.squared_error / (2.0 * static_cast<double>(views.size())));
  if (!fit.in_front || rms_sigma > options.max_residual_sigma) return std::nullopt;
  return inverse_depth;
}

}  // namespace slcmap
