#include "odometry/window/point_landmarks.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "odometry/window/landmark_information.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinParallax_rad = 0.01;  // between the host's ray and some other one

// One view of the point: p_camera ~ ray + lambda * offset, measured on z = 1.
struct View {
  Vector3d ray, offset;
  Vector2d measured;
};

std::vector<View> CollectViews(const PointLandmark& landmark, const StereoGeometry& geometry) {
  std::vector<View> views;
  const RigidTransform T_world_host = WorldFromHost(landmark, geometry);
  const Vector2d left = landmark.host()->measurements.at(landmark.id).left;
  const Vector3d ray = geometry.OnTruePlane(landmark.camera, left).homogeneous();
  for (const FrameState* frame : landmark.frames) {
    const StereoMeasurement& measurement = frame->measurements.at(landmark.id);
    const RigidTransform T_imu_world = frame->T_world_imu().Inverse();
    for (int c = 0; c < 2; ++c) {
      if (c == 0 && frame == landmark.host()) continue;
      if (c == 1 && !measurement.right) continue;
      const int camera = measurement.camera + c;
      const RigidTransform T = geometry.T_imu_camera[camera].Inverse() * T_imu_world * T_world_host;
      views.push_back(
          {T.rotation * ray, T.translation,
           geometry.OnTruePlane(camera, c == 0 ? measurement.left : *measurement.right)});
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
  const std::vector<View> views = CollectViews(landmark, geometry);
  if (views.empty()) return std::nullopt;
  double parallax_rad = 0;
  double inverse_depth = LinearInverseDepth(views, &parallax_rad);
  if (parallax_rad < kMinParallax_rad) return std::nullopt;
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

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

void RemoveMeasurement(PointLandmark* landmark, FrameState* frame) {
  std::erase(landmark->frames, frame);
  frame->measurements.erase(landmark->id);
}

}  // namespace

void RegisterPoints(FrameState* frame, WindowState* window) {
  for (const auto& [id, measurement] : frame->measurements) {
    PointLandmark& landmark = window->landmarks[id];
    landmark.id = id;
    landmark.camera = measurement.camera;
    landmark.frames.push_back(frame);
  }
}

void TriangulatePoints(const PointTriangulationOptions& options, const StereoGeometry& geometry,
                       WindowState* window) {
  for (auto& [id, landmark] : window->landmarks) {
    if (landmark.triangulated) continue;
    const auto inverse_depth = TriangulateInverseDepth(landmark, geometry, options);
    landmark.triangulated = inverse_depth.has_value();
    if (!inverse_depth) continue;
    const Vector2d left =
        geometry.OnTruePlane(landmark.camera, landmark.host()->measurements.at(id).left);
    landmark.point = {left.x(), left.y(), *inverse_depth};
  }
}

std::pair<double, double> ObservationChi2(const PointLandmark& landmark, const FrameState& frame,
                                          const CostModel& model) {
  return Chi2OfObservation(FixedPointTerm(landmark, frame, model));
}

std::unordered_set<int64_t> RejectPointOutliers(double max_chi2, const CostModel& model,
                                                WindowState* window, PointFit* fit) {
  std::unordered_set<int64_t> outliers;
  PointFit all_points;
  for (auto it = window->landmarks.begin(); it != window->landmarks.end();) {
    PointLandmark& landmark = it->second;
    int bad = 0, all = 0;
    const std::vector<FrameState*> frames = landmark.frames;
    for (FrameState* frame : frames) {
      if (!landmark.triangulated) break;
      const auto [left, right] = ObservationChi2(landmark, *frame, model);
      ++all;
      all_points.Add(left, max_chi2);
      if (right > 0) all_points.Add(right, max_chi2);
      if (right > max_chi2) frame->measurements.at(landmark.id).right.reset();
      if (left <= max_chi2) continue;
      ++bad;
      // The point is expressed in its host: without the host's observation it is not worth keeping.
      if (frame == landmark.host()) bad = 2 * static_cast<int>(frames.size());
      if (frame != landmark.host()) RemoveMeasurement(&landmark, frame);
    }
    const bool outlier =
        2 * bad > all || (landmark.triangulated && landmark.inverse_depth_per_m() <= 0);
    if (outlier) {
      outliers.insert(landmark.id);
      for (FrameState* frame : landmark.frames) frame->measurements.erase(landmark.id);
      it = window->landmarks.erase(it);
    } else {
      ++it;
    }
  }
  if (fit != nullptr) *fit = all_points;
  return outliers;
}

bool Rehost(const StereoGeometry& geometry, PointLandmark* landmark) {
  const Vector3d p_world = LandmarkInWorld(*landmark, geometry);
  landmark->frames.erase(landmark->frames.begin());
  const RigidTransform T_world_camera = WorldFromHost(*landmark, geometry);
  const Vector3d p_camera = T_world_camera.Inverse() * p_world;
  if (p_camera.z() < 0.05) return false;
  landmark->point = {p_camera.x() / p_camera.z(), p_camera.y() / p_camera.z(), 1.0 / p_camera.z()};
  ++landmark->released_frames;
  return true;
}

double ReprojectionRms(const CostModel& model, const WindowState& window) {
  double sum = 0;
  int rows = 0;
  for (const auto& [id, landmark] : window.landmarks) {
    if (!landmark.triangulated) continue;
    for (const FixedTerm& term : FixedPointTerms(landmark, model)) {
      sum += ComputeResidual(term).squaredNorm();
      rows += term.factor->rows();
    }
  }
  return rows > 0 ? std::sqrt(sum / rows) : 0;
}

int TriangulatedCount(const WindowState& window) {
  return static_cast<int>(std::count_if(window.landmarks.begin(), window.landmarks.end(),
                                        [](const auto& l) { return l.second.triangulated; }));
}

Landmark Describe(const PointLandmark& landmark, const CostModel& model,
                  const WindowCovariance& window) {
  Landmark out;
  out.id = landmark.id;
  out.p_world = LandmarkInWorld(landmark, model.geometry);
  const RigidTransform T_world_camera = WorldFromHost(landmark, model.geometry);
  const Vector3d ray = (out.p_world - T_world_camera.translation).normalized();
  const auto covariance_m2 = CovarianceFromHost(landmark, model, window);
  const double variance_m2 = covariance_m2 ? ray.dot(*covariance_m2 * ray) : -1;
  out.sigma_m = variance_m2 >= 0 ? std::sqrt(variance_m2) : kUnknownSigma_m;  // NaN too
  out.observations = static_cast<int>(landmark.frames.size()) + landmark.released_frames;
  return out;
}

}  // namespace slcmap::odometry
