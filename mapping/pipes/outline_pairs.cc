#include "mapping/pipes/outline_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>

#include "data/quantile.h"
#include "mapping/lines/line_in_view.h"
#include "mapping/lines/line_samples.h"
#include "mapping/pipes/across_axis.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastWidth_px = 4;     // below, blur moves outlines by too much of it
constexpr double kLeastDistance = 3;     // of the camera from the axis, in radii
constexpr double kLeastSigma_px = 0.12;  // of where an outline is

// A rectified image: its camera, and where that is.
struct CameraAt {
  const Camera& camera;
  const RigidTransform& T_camera_world;

  Vector3d Centre() const { return T_camera_world.Inverse().translation; }

  // How far a place moves in the image, in pixels, as it moves in the world by so much.
  Vector2d Moved_px(const Vector3d& p_world, const Vector3d& way_world) const {
    const Vector3d p = T_camera_world * p_world, way = T_camera_world.rotation * way_world;
    return {camera.fx_px * (way.x() - p.x() / p.z() * way.z()) / p.z(),
            camera.fy_px * (way.y() - p.y() / p.z() * way.z()) / p.z()};
  }
};

// What a camera would have of a cylinder: planes through it that touch the cylinder. Nothing where
// it is too near, or so far that the image is thin.
std::optional<OutlinePair> Expected(const Cylinder& cylinder, const AcrossAxis& across,
                                    const CameraAt& at) {
  const Vector2d centre = across.Place(at.Centre());
  const double distance_m = centre.norm(), radius_m = cylinder.radius_m;
  if (distance_m < kLeastDistance * radius_m ||
      2 * radius_m * at.camera.fx_px < kLeastWidth_px * distance_m) {
    return std::nullopt;
  }
  const Vector2d out = centre / distance_m, aside(-out.y(), out.x());
  const double sine = radius_m / distance_m, cosine = std::sqrt(1 - sine * sine);
  OutlinePair pair;
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? -1 : 1;
    pair.normals[i] = sign * sine * out + cosine * aside;
    pair.offsets_m[i] = sign * radius_m;
  }
  return pair;
}

struct FoundOutline {
  double across_px = 0;  // from where it is expected, to the left of the axis as the image shows it
  double sigma_px = 0;
};

// The outline near a line: brighter on one side of it, the same all along. Nothing where much of it
// is not there, or not straight.
std::optional<FoundOutline> OutlineNear(const PointAndDirection& line, const Stretch& stretch,
                                        const StereoImage& pair, const cv::Mat& mask, int camera,
                                        const CameraAt& at, double reach_px) {
  constexpr size_t kLeastSamples = 6;
  constexpr double kLeastShare = 0.6, kMostScatter_px = 0.8;
  constexpr double kIndependent = 0.3;  // of the samples
  LineSampling sampling;
  sampling.step_m = 0.03;
  sampling.min_step_px = 4;
  sampling.reach_px = reach_px;
  std::vector<double> found_px;
  size_t samples = 0;
  for (const double sense : {1.0, -1.0}) {
    const auto seen = SeenPart({line.point_world, sense * line.direction_world},
                               sense > 0 ? stretch : Stretch{-stretch.to_m, -stretch.from_m},
                               at.T_camera_world, at.camera, {});
    if (!seen) return std::nullopt;
    std::vector<double> of_sense_px;
    const auto all = SampleLine(camera == 0 ? pair.left : pair.right, mask, *seen, sampling);
    for (const LineSample& sample : all) {
      if (sample.is_edge) of_sense_px.push_back(sense * sample.across_px);
    }
    samples = std::max(samples, all.size());
    if (of_sense_px.size() > found_px.size()) found_px = std::move(of_sense_px);
  }
  if (samples < kLeastSamples ||
      static_cast<double>(found_px.size()) < kLeastShare * static_cast<double>(samples)) {
    return std::nullopt;
  }
  const double scatter_px = Quantile(found_px, 0.75) - Quantile(found_px, 0.25);
  if (scatter_px > kMostScatter_px) return std::nullopt;
  const double independent = kIndependent * static_cast<double>(found_px.size());
  return FoundOutline{Quantile(found_px, 0.5),
                      std::hypot(kLeastSigma_px, scatter_px / std::sqrt(independent))};
}

// Nothing where an outline is not seen well.
std::optional<OutlinePair> PairIn(const StereoImage& images, const cv::Mat& mask, int camera,
                                  const CameraAt& at, const PipePlace& place) {
  constexpr double kReach = 0.3, kLeastReach_px = 1.5, kMostReach_px = 4;  // of the width
  const PointAndDirection& axis = place.cylinder.axis;
  const AcrossAxis across(axis);
  std::optional<OutlinePair> pair = Expected(place.cylinder, across, at);
  if (!pair) return std::nullopt;
  const double width_px =
      2 * place.cylinder.radius_m * at.camera.fx_px / across.Place(at.Centre()).norm();
  const double reach_px = std::clamp(kReach * width_px, kLeastReach_px, kMostReach_px);
  for (int i = 0; i < 2; ++i) {
    const Vector3d normal = across.DirectionInWorld(pair->normals[i]);
    const PointAndDirection line{axis.point_world + pair->offsets_m[i] * normal,
                                 axis.direction_world};
    const auto seen = SeenPart(line, place.stretch, at.T_camera_world, at.camera, {});
    const auto found = OutlineNear(line, place.stretch, images, mask, camera, at, reach_px);
    if (!seen || !found) return std::nullopt;
    const Vector2d way_px = (seen->px.end - seen->px.start).normalized();
    const Vector3d middle =
        line.point_world + 0.5 * (seen->from_m + seen->to_m) * line.direction_world;
    const double px_per_m = at.Moved_px(middle, normal).dot(Vector2d(way_px.y(), -way_px.x()));
    if (px_per_m == 0) return std::nullopt;
    pair->offsets_m[i] += found->across_px / px_per_m;
    pair->sigma_m = std::max(pair->sigma_m, found->sigma_px / std::abs(px_per_m));
  }
  return pair;
}

// What a camera that has a place in its image would show of it.
std::optional<OutlinePair> ExpectedIn(const PipePlace& place, const CameraAt& at) {
  const PointAndDirection& axis = place.cylinder.axis;
  const auto pair = Expected(place.cylinder, AcrossAxis(axis), at);
  const bool is_seen = pair && SeenPart(axis, place.stretch, at.T_camera_world, at.camera, {});
  return is_seen ? pair : std::nullopt;
}

CameraAt CameraOf(const ViewCameras& cameras, size_t view, int camera) {
  return {cameras.cameras[camera], cameras.T_camera_world[view][camera]};
}

// Of the places, those that a view's cameras may show.
std::vector<size_t> PlacesIn(size_t view, const std::vector<PipePlace>& places,
                             const ViewCameras& cameras) {
  std::vector<size_t> seen;
  for (size_t i = 0; i < places.size(); ++i) {
    if (ExpectedIn(places[i], CameraOf(cameras, view, 0)) ||
        ExpectedIn(places[i], CameraOf(cameras, view, 1))) {
      seen.push_back(i);
    }
  }
  return seen;
}

}  // namespace

std::vector<OutlinePair> ExpectedPairs(const PipePlace& place, const ViewCameras& cameras) {
  const AcrossAxis across(place.cylinder.axis);
  std::vector<OutlinePair> pairs;
  for (size_t view = 0; view < cameras.T_camera_world.size(); ++view) {
    for (int camera = 0; camera < 2; ++camera) {
      const CameraAt at = CameraOf(cameras, view, camera);
      auto pair = ExpectedIn(place, at);
      if (!pair) continue;
      pair->sigma_m = kLeastSigma_px * across.Place(at.Centre()).norm() / at.camera.fx_px;
      pairs.push_back(*pair);
    }
  }
  return pairs;
}

std::vector<std::vector<OutlinePair>> FindOutlinePairs(const std::vector<PipePlace>& places,
                                                       const PipeImages& images,
                                                       const std::vector<size_t>& views,
                                                       const Progress& progress) {
  const ViewCameras cameras(images.views, images.images.rig());
  std::vector<std::vector<OutlinePair>> pairs(places.size());
  double done = 0;
  for (const size_t view : views) {
    if (!progress.Report(done++ / static_cast<double>(views.size()))) break;
    const std::vector<size_t> seen = PlacesIn(view, places, cameras);
    if (seen.empty()) continue;
    const StereoImage read = images.images.Read(view);
    if (read.left.empty() || read.right.empty()) continue;
    cv::parallel_for_({0, static_cast<int>(seen.size())}, [&](const cv::Range& range) {
      for (int k = range.start; k < range.end; ++k) {
        for (int camera = 0; camera < 2; ++camera) {
          const auto pair = PairIn(read, images.images.mask(camera), camera,
                                   CameraOf(cameras, view, camera), places[seen[k]]);
          if (pair) pairs[seen[k]].push_back(*pair);
        }
      }
    });
  }
  return pairs;
}

}  // namespace slcmap
