#include "mapping/pipes/outline_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "data/quantile.h"
#include "mapping/dense/parallel.h"
#include "mapping/lines/line_in_view.h"
#include "mapping/lines/line_samples.h"
#include "mapping/pipes/across_axis.h"
#include "mapping/read_ahead.h"
#include "mapping/watched_loop.h"
#include "odometry/frontend/line_geometry.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

CameraAt CameraOf(const ViewCameras& cameras, size_t view, int camera) {
  return {cameras.cameras[camera], cameras.T_camera_world[view][camera]};
}

// What an image would have of a place: planes through the camera that touch the cylinder.
struct ExpectedPair {
  OutlinePair pair;
  double width_px = 0;  // in the middle of what is seen
};

// Nothing where the image does not have the place, or the camera is too near, or so far away that
// the image is thin.
std::optional<ExpectedPair> ExpectedIn(const PipePlace& place, const CameraAt& at) {
  const double radius_m = place.cylinder.radius_m;
  const Vector2d centre = AcrossAxis(place.cylinder.axis).Place(at.Centre());
  const double distance_m = centre.norm();
  if (distance_m < kLeastDistance * radius_m) return std::nullopt;
  const auto seen = SeenPart(place.cylinder.axis, place.stretch, at.T_camera_world, at.camera, {});
  if (!seen) return std::nullopt;
  const double pixel_m = seen->DepthAt(0.5) / at.camera.fx_px;
  ExpectedPair expected;
  expected.width_px = 2 * radius_m / pixel_m;
  if (expected.width_px < kLeastPipeWidth_px) return std::nullopt;
  const Vector2d out = centre / distance_m, aside(-out.y(), out.x());
  const double sine = radius_m / distance_m, cosine = std::sqrt(1 - sine * sine);
  expected.pair.sigma_m = kLeastSigma_px * pixel_m;
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? -1 : 1;
    expected.pair.normals[i] = sign * sine * out + cosine * aside;
    expected.pair.offsets_m[i] = sign * radius_m;
  }
  return expected;
}

// The outline of a pipe that an image may have near a line along its axis.
class OutlineSearch {
 public:
  OutlineSearch(const cv::Mat& image, const cv::Mat& mask, const CameraAt& at, double width_px)
      : image_(image), mask_(mask), at_(at) {
    constexpr double kReach = 0.3, kLeastReach_px = 1.5, kMostReach_px = 4;  // of the width
    sampling_.step_m = 0.03;
    sampling_.min_step_px = 4;
    sampling_.reach_px = std::clamp(kReach * width_px, kLeastReach_px, kMostReach_px);
  }

  struct Found {
    double offset_m = 0;  // from the line, along the normal
    double sigma_m = 0;
  };

  // Brighter on one side of it, the same all along. Nothing where much of it is not there, or not
  // straight.
  std::optional<Found> Find(const PointAndDirection& line, const Stretch& stretch,
                            const Vector3d& normal_world) const {
    constexpr size_t kLeastSamples = 6;
    constexpr double kLeastShare = 0.6, kMostScatter_px = 0.8;
    constexpr double kIndependent = 0.3;  // of the samples
    const auto seen = SeenPart(line, stretch, at_.T_camera_world, at_.camera, {});
    if (!seen) return std::nullopt;
    const Samples brighter_left = SamplesOf(line, *seen, normal_world, 1);
    const Samples brighter_right = SamplesOf(line, *seen, normal_world, -1);
    const std::vector<double>& offsets_m =
        brighter_left.offsets_m.size() >= brighter_right.offsets_m.size()
            ? brighter_left.offsets_m
            : brighter_right.offsets_m;
    const size_t samples = std::max(brighter_left.all, brighter_right.all);
    const auto found = static_cast<double>(offsets_m.size());
    if (samples < kLeastSamples || found < kLeastShare * static_cast<double>(samples)) {
      return std::nullopt;
    }
    const double pixel_m = seen->DepthAt(0.5) / at_.camera.fx_px;
    const double scatter_px = (Quantile(offsets_m, 0.75) - Quantile(offsets_m, 0.25)) / pixel_m;
    if (scatter_px > kMostScatter_px) return std::nullopt;
    return Found{
        Quantile(offsets_m, 0.5),
        pixel_m * std::hypot(kLeastSigma_px, scatter_px / std::sqrt(kIndependent * found))};
  }

 private:
  struct Samples {
    std::vector<double> offsets_m;  // of those where an edge is
    size_t all = 0;
  };

  // Of edges that are brighter on the left of the line (sense 1), or on its right (-1).
  Samples SamplesOf(const PointAndDirection& line, const LineInView& seen,
                    const Vector3d& normal_world, double sense) const {
    const PointAndDirection directed{line.point_world, sense * line.direction_world};
    LineInView view = seen;
    if (sense < 0) {
      view.px = Reversed(seen.px);
      std::swap(view.start_depth_m, view.end_depth_m);
      view.from_m = -seen.to_m;
      view.to_m = -seen.from_m;
    }
    const Vector2d left_px = Normal(view.px);
    Samples samples;
    for (const LineSample& sample : SampleLine(image_, mask_, view, sampling_)) {
      ++samples.all;
      if (!sample.is_edge) continue;
      const Vector3d p = directed.point_world + sample.along_m * directed.direction_world;
      const double px_per_m = at_.Moved_px(p, normal_world).dot(left_px);
      if (px_per_m != 0) samples.offsets_m.push_back(sample.across_px / px_per_m);
    }
    return samples;
  }

  const cv::Mat& image_;
  const cv::Mat& mask_;
  const CameraAt at_;
  LineSampling sampling_;
};

// Nothing where an outline is not seen well.
std::optional<OutlinePair> PairIn(const cv::Mat& image, const cv::Mat& mask, const CameraAt& at,
                                  const PipePlace& place) {
  const auto expected = ExpectedIn(place, at);
  if (image.empty() || !expected) return std::nullopt;
  const PointAndDirection& axis = place.cylinder.axis;
  const AcrossAxis across(axis);
  const OutlineSearch search(image, mask, at, expected->width_px);
  OutlinePair pair = expected->pair;
  pair.sigma_m = 0;
  for (int i = 0; i < 2; ++i) {
    const Vector3d normal = across.DirectionInWorld(pair.normals[i]);
    const auto found =
        search.Find({axis.point_world + pair.offsets_m[i] * normal, axis.direction_world},
                    place.stretch, normal);
    if (!found) return std::nullopt;
    pair.offsets_m[i] += found->offset_m;
    pair.sigma_m = std::max(pair.sigma_m, found->sigma_m);
  }
  return pair;
}

// Of the places, those that a view's images may show.
std::vector<size_t> PlacesIn(const View& view, const std::array<CameraAt, 2>& cameras,
                             const std::vector<PipePlace>& places) {
  std::vector<size_t> seen;
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i].segment == view.segment &&
        (ExpectedIn(places[i], cameras[0]) || ExpectedIn(places[i], cameras[1]))) {
      seen.push_back(i);
    }
  }
  return seen;
}

}  // namespace

std::vector<OutlinePair> ExpectedPairs(const PipePlace& place, const Views& views,
                                       const ViewCameras& cameras) {
  std::vector<OutlinePair> pairs;
  for (size_t view = 0; view < views.size(); ++view) {
    if (views[view].segment != place.segment) continue;
    for (int camera = 0; camera < 2; ++camera) {
      const auto expected = ExpectedIn(place, CameraOf(cameras, view, camera));
      if (expected) pairs.push_back(expected->pair);
    }
  }
  return pairs;
}

std::vector<std::vector<OutlinePair>> FindOutlinePairs(const std::vector<PipePlace>& places,
                                                       const PipeImages& images,
                                                       const std::vector<size_t>& views,
                                                       const Progress& progress) {
  const ViewCameras all(images.views, images.images.rig());
  const auto cameras_of = [&](size_t view) {
    return std::array{CameraOf(all, view, 0), CameraOf(all, view, 1)};
  };
  std::vector<std::pair<size_t, std::vector<size_t>>> seen_in;  // views, and the places there
  for (const size_t view : views) seen_in.push_back({view, {}});
  ForEachWatched(views.size(), {}, [&](size_t i) {
    seen_in[i].second = PlacesIn(images.views[views[i]], cameras_of(views[i]), places);
  });
  std::erase_if(seen_in, [](const auto& view) { return view.second.empty(); });
  ReadAhead<StereoImage> coming(seen_in.size(),
                                [&](size_t i) { return images.images.Read(seen_in[i].first); });
  std::vector<std::vector<OutlinePair>> pairs(places.size());
  double done = 0;
  for (const auto& [view, seen] : seen_in) {
    if (!progress.Report(done++ / static_cast<double>(seen_in.size()))) break;
    const auto cameras = cameras_of(view);
    const StereoImage read = coming.Next();
    // Not by cv::parallel_for_(), see LineFinder::LookAt().
    ParallelFor(0, seen.size(), cv::getNumThreads(), [&](size_t k) {
      for (int camera = 0; camera < 2; ++camera) {
        const auto pair = PairIn(camera == 0 ? read.left : read.right, images.images.mask(camera),
                                 cameras[camera], places[seen[k]]);
        if (pair) pairs[seen[k]].push_back(*pair);
      }
    });
  }
  return pairs;
}

}  // namespace slcmap
