#include "mapping/pipes/outline_pairs.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "data/core/math.h"
#include "data/core/parallel.h"
#include "mapping/lines/line_samples.h"
#include "mapping/pipes/pipe_fit.h"
#include "odometry/frontend/line_segment.h"

namespace slcmap::inline mapping {
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

CameraAt GetCamera(const ViewCameras& cameras, size_t view, int camera) {
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
  const auto seen = SeenPart(place.cylinder.axis, place.interval, at.T_camera_world, at.camera, {});
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
  std::optional<Found> Find(const PointAndDirection& line, const Interval& interval,
                            const Vector3d& normal_world) const {
    constexpr size_t kLeastSamples = 6;
    constexpr double kLeastShare = 0.6, kMostScatter_px = 0.8;
    constexpr double kIndependent = 0.3;  // of the samples
    const auto seen = SeenPart(line, interval, at_.T_camera_world, at_.camera, {});
    if (!seen) return std::nullopt;
    const Samples brighter_left = CollectSamples(line, *seen, normal_world, 1);
    const Samples brighter_right = CollectSamples(line, *seen, normal_world, -1);
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
  Samples CollectSamples(const PointAndDirection& line, const LineInView& seen,
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
                    place.interval, normal);
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
      const auto expected = ExpectedIn(place, GetCamera(cameras, view, camera));
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
    return std::array{GetCamera(all, view, 0), GetCamera(all, view, 1)};
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
    ParallelFor(seen.size(), [&](size_t k) {
      for (int camera = 0; camera < 2; ++camera) {
        const auto pair =
            PairIn(camera == 0 ? read.left : read.right, images.images.mask_of(view, camera),
                   cameras[camera], places[seen[k]]);
        if (pair) pairs[seen[k]].push_back(*pair);
      }
    });
  }
  return pairs;
}

namespace {

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

double ExpectEdgeMisfit(const std::vector<OutlinePair>& pairs, double pose_sigma_m) {
  return FitEdges(pairs, pose_sigma_m);
}

WidthEvidence CollectWidthEvidence(const std::vector<OutlinePair>& pairs, double radius_m,
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
  evidence.told = ExpectEdgeMisfit(perfect, pose_sigma_m);
  return evidence;
}

namespace {

// The indices of those that `holds` for; none once progress says so.
template <typename Holds>
std::vector<size_t> Where(size_t count, const Progress& progress, Holds holds) {
  std::vector<char> each(count, 0);
  if (!ForEachWatched(count, progress, [&](size_t i) { each[i] = holds(i); })) return {};
  std::vector<size_t> indices;
  for (size_t i = 0; i < count; ++i) {
    if (each[i]) indices.push_back(i);
  }
  return indices;
}

template <typename Item>
std::vector<Item> Some(const std::vector<Item>& items, const std::vector<size_t>& indices) {
  std::vector<Item> some;
  for (const size_t i : indices) some.push_back(items[i]);
  return some;
}

// Of a part of the images, that often tells little: whether the others may make a pipe of it.
bool IsPromising(const WidthEvidence& widths) {
  constexpr int kLeastImages = 2;
  constexpr double kMostOfImage = 4, kFew = 3;
  return widths.images >= kLeastImages && widths.cylinder <= widths.edges + kFew &&
         widths.cylinder <= kMostOfImage * widths.images;
}

}  // namespace

std::vector<WidthEvidence> MeasureWidths(const std::vector<PipePlace>& places,
                                         const PipeImages& images, double pose_sigma_m,
                                         const Progress& progress) {
  constexpr size_t kEach = 4;                     // view is looked at first
  constexpr double kChosen = 0.1, kFirst = 0.65;  // of the time
  const ViewCameras cameras(images.views, images.images.rig());
  std::vector<WidthEvidence> widths(places.size());
  const auto evidence = [&](const std::vector<OutlinePair>& pairs, size_t place) {
    return CollectWidthEvidence(pairs, places[place].cylinder.radius_m, pose_sigma_m);
  };
  const auto told = Where(places.size(), progress.Part(0, kChosen), [&](size_t i) {
    return ExpectEdgeMisfit(ExpectedPairs(places[i], images.views, cameras), pose_sigma_m) >=
           kLeastEdgeMisfit;
  });
  std::vector<size_t> first, others;
  for (size_t view = 0; view < images.views.size(); ++view) {
    (view % kEach == 0 ? first : others).push_back(view);
  }
  auto pairs = FindOutlinePairs(Some(places, told), images, first, progress.Part(kChosen, kFirst));
  const auto promising = Where(told.size(), progress.Part(kFirst, kFirst),
                               [&](size_t k) { return IsPromising(evidence(pairs[k], told[k])); });
  const auto more = FindOutlinePairs(Some(places, Some(told, promising)), images, others,
                                     progress.Part(kFirst, 1));
  // What part of the images says may be wrong.
  if (!progress.Report(1)) return widths;
  ForEachWatched(promising.size(), {}, [&](size_t j) {
    const size_t k = promising[j];
    pairs[k].insert(pairs[k].end(), more[j].begin(), more[j].end());
    widths[told[k]] = evidence(pairs[k], told[k]);
  });
  return widths;
}

}  // namespace slcmap::mapping
