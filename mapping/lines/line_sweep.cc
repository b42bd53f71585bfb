#include "mapping/lines/line_sweep.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgproc.hpp>

#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap::inline mapping {

// Where an image has edges, and which way brightness rises there: quick to ask for many places.

// CV_16UC1 of the image's size: bit i is set where, within a pixel, there is an edge across which
// brightness rises towards the angle i * 22.5 degrees (x right, y down), give or take 22.5 degrees.
// Edges are the pixels whose gradient is the largest across them and at least min_gradient grey
// values a pixel.
cv::Mat EdgeDirections(const cv::Mat& image, double min_gradient);

// The bit of EdgeDirections for edges across which brightness rises towards `normal`.
uint16_t DirectionBit(const Eigen::Vector2d& normal);

namespace {

constexpr double kSweepMinDepth_m = 0.4;
constexpr double kStep_px = 1.5;  // by which an image of the line moves from one depth to the next
constexpr double kMinBaseline_m = 0.08;  // of a view to be looked at
constexpr double kMaxBaseline_m = 1.5;
constexpr double kSweepMaxTurn_rad = 0.7;  // likewise
constexpr double kMinParallax_m = 0.05;    // across the plane of camera and line, of some image
constexpr int kMaxViews = 7;
// of the samples of an image that have an edge: it shows the line
constexpr double kSweepMinShare = 0.7;
constexpr int kMinImages = 4;      // that show the line
constexpr double kMinLead = 0.25;  // of the images that show it more than at any other depth

constexpr int kDirections = 16;
constexpr int kSobelGain = 8;  // of a 3x3 Sobel kernel against the change a pixel

int GetDirection(double x, double y) {
  const double turns = std::atan2(y, x) / (2 * M_PI);
  return (static_cast<int>(std::lround(turns * kDirections)) + kDirections) % kDirections;
}

// The bits of a direction and its two neighbours.
std::array<uint16_t, kDirections> NeighbouringBits() {
  std::array<uint16_t, kDirections> bits{};
  for (int i = 0; i < kDirections; ++i) {
    for (int k : {kDirections - 1, 0, 1}) {
      bits[i] = static_cast<uint16_t>(bits[i] | 1 << (i + k) % kDirections);
    }
  }
  return bits;
}

// The step to the pixel that lies towards a gradient.
cv::Point StepTowards(int dx, int dy) {
  const int ax = std::abs(dx), ay = std::abs(dy);
  const int sx = dx > 0 ? 1 : -1, sy = dy > 0 ? 1 : -1;
  if (5 * ay < 2 * ax) return {sx, 0};  // tan 22.5 degrees is nearly 2 / 5
  if (5 * ax < 2 * ay) return {0, sy};
  return {sx, sy};
}

// The bits of each edge pixel by itself.
cv::Mat EdgePixels(const cv::Mat& image, double min_gradient) {
  static const std::array<uint16_t, kDirections> kBits = NeighbouringBits();
  cv::Mat dx, dy;
  cv::spatialGradient(image, dx, dy);
  const auto squared = [&](int v, int u) {
    const int x = dx.at<int16_t>(v, u), y = dy.at<int16_t>(v, u);
    return x * x + y * y;
  };
  const double least = std::pow(kSobelGain * min_gradient, 2);
  cv::Mat pixels = cv::Mat::zeros(image.size(), CV_16UC1);
  for (int v = 1; v + 1 < image.rows; ++v) {
    for (int u = 1; u + 1 < image.cols; ++u) {
      const int here = squared(v, u);
      if (here < least) continue;
      const int x = dx.at<int16_t>(v, u), y = dy.at<int16_t>(v, u);
      const cv::Point step = StepTowards(x, y);
      if (squared(v + step.y, u + step.x) > here || squared(v - step.y, u - step.x) > here) {
        continue;
      }
      pixels.at<uint16_t>(v, u) = kBits[GetDirection(x, y)];
    }
  }
  return pixels;
}

}  // namespace

cv::Mat EdgeDirections(const cv::Mat& image, double min_gradient) {
  const cv::Mat pixels = EdgePixels(image, min_gradient);
  cv::Mat spread = cv::Mat::zeros(image.size(), CV_16UC1);
  for (int v = 1; v + 1 < image.rows; ++v) {
    for (int u = 1; u + 1 < image.cols; ++u) {
      const uint16_t bits = pixels.at<uint16_t>(v, u);
      if (bits == 0) continue;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) spread.at<uint16_t>(v + dv, u + du) |= bits;
      }
    }
  }
  return spread;
}

uint16_t DirectionBit(const Eigen::Vector2d& normal) {
  return static_cast<uint16_t>(1 << GetDirection(normal.x(), normal.y()));
}

namespace {

constexpr double kSampleStep_px = 4;
constexpr int kMinSamples = 4, kMaxSamples = 20;
constexpr double kMinTilt = 0.2;  // sine of the angle to the baseline from which disparities tell

// The share of samples along a line's image that have an edge of its orientation.
double ShareOfEdges(const cv::Mat& edges, const LineSegment& px) {
  const int count =
      std::clamp(static_cast<int>(px.Length() / kSampleStep_px), kMinSamples, kMaxSamples);
  const uint16_t bit = DirectionBit(Normal(px));
  const Eigen::Vector2d step = (px.end - px.start) / count;
  Eigen::Vector2d p = px.start + 0.5 * step;
  int found = 0;
  for (int i = 0; i < count; ++i, p += step) {
    const int u = static_cast<int>(p.x() + 0.5), v = static_cast<int>(p.y() + 0.5);
    found += (edges.at<uint16_t>(v, u) & bit) != 0;
  }
  return static_cast<double>(found) / count;
}

// Images that show the line; one that sees none of it counts a third.
struct Support {
  int images = 0;
  double score = 0;
};

Support MeasureSupport(const PointAndDirection& line, const Interval& seen,
                       const std::vector<SweepImage>& images, const ViewCameras& views) {
  constexpr double kMinLength_px = 8, kMissCost = 0.35;
  Support support;
  for (const SweepImage& image : images) {
    const auto part = SeenPart(line, seen, views.T_camera_world[image.view][image.camera],
                               views.cameras[image.camera], {});
    if (!part || part->px.Length() < kMinLength_px) continue;
    if (part->to_m - part->from_m < 0.5 * (seen.to_m - seen.from_m)) continue;
    const double share = ShareOfEdges(image.edges, part->px);
    if (share >= kSweepMinShare) {
      ++support.images;
      support.score += share;
    } else {
      support.score -= kMissCost * (1 - share);
    }
  }
  return support;
}

// The interval of a line between the rays of a segment's ends, with the line running as the
// segment.
std::optional<Interval> FindInterval(PointAndDirection* line, const LineSegment& segment,
                                     const RigidTransform& T_world_camera) {
  const auto extent = ExtentAlong(*line, segment, T_world_camera);
  if (!extent) return std::nullopt;
  const Eigen::Vector3d step = T_world_camera.rotation.conjugate() * line->direction_world;
  const Eigen::Vector3d p = T_world_camera.Inverse() * line->point_world;
  const Eigen::Vector2d moved = (p + 1e-3 * step).hnormalized() - p.hnormalized();
  if (moved.dot(segment.end - segment.start) >= 0) return Interval{extent->first, extent->second};
  line->direction_world = -line->direction_world;
  return Interval{-extent->second, -extent->first};
}

// Lines by inverse depth, in rising order, and the best of them.
class BestLine {
 public:
  void Offer(double inverse_depth, const SweptLine& line, const Support& support) {
    scores_.push_back({inverse_depth, line.score});
    if (best_ && best_->score >= line.score) return;
    best_ = line;
    images_ = support.images;
    peak_ = inverse_depth;
  }

  // Nothing where another peak is nearly as high: what lies beyond the depths around the best at
  // which the score has fallen by half.
  std::optional<SweptLine> Result() const {
    if (!best_ || images_ < kMinImages) return std::nullopt;
    double below = -1, above = std::numeric_limits<double>::infinity();  // where it has fallen
    for (const auto& [inverse_depth, score] : scores_) {
      if (score > 0.5 * best_->score) continue;
      if (inverse_depth < peak_) below = std::max(below, inverse_depth);
      if (inverse_depth > peak_) above = std::min(above, inverse_depth);
    }
    for (const auto& [inverse_depth, score] : scores_) {
      const bool is_beyond = inverse_depth < below || inverse_depth > above;
      if (is_beyond && score > (1 - kMinLead) * best_->score) return std::nullopt;
    }
    return best_;
  }

 private:
  std::vector<std::pair<double, double>> scores_;  // by inverse depth
  std::optional<SweptLine> best_;
  int images_ = 0;
  double peak_ = 0;
};

// The farthest that a camera is from the plane through a line and the segment's own camera: a move
// within that plane does not tell how far the line is.
double LongestParallax_m(int view, const Eigen::Vector3d& normal_world,
                         const std::vector<SweepImage>& images, const ViewCameras& views) {
  double longest_m = 0;
  for (const SweepImage& image : images) {
    const Eigen::Vector3d baseline = views.Centre(image.view, image.camera) - views.Centre(view);
    longest_m = std::max(longest_m, std::abs(normal_world.dot(baseline)));
  }
  return longest_m;
}

}  // namespace

std::optional<SweptLine> SweepAlongAxis(const LineSegment& segment, int view,
                                        const Eigen::Vector3d& direction_world,
                                        const std::vector<SweepImage>& images,
                                        const ViewCameras& views, const LineSweepOptions& options) {
  const RigidTransform T_world_camera = views.T_camera_world[view][0].Inverse();
  const Eigen::Vector3d ray = segment.Midpoint().homogeneous();
  const Eigen::Vector3d normal = (T_world_camera.rotation * ray).cross(direction_world);
  const double parallax_m = LongestParallax_m(view, normal.normalized(), images, views);
  if (parallax_m < kMinParallax_m) return std::nullopt;
  const double step = kStep_px / (views.cameras[0].fx_px * parallax_m);
  BestLine best;
  for (double w = 1 / options.max_depth_m; w < 1 / kSweepMinDepth_m; w += step) {
    SweptLine swept;
    swept.line = {T_world_camera * (ray / w), direction_world};
    const auto seen = FindInterval(&swept.line, segment, T_world_camera);
    if (!seen) continue;
    swept.seen = *seen;
    const Support support = MeasureSupport(swept.line, swept.seen, images, views);
    swept.score = support.score;
    best.Offer(w, swept, support);
  }
  return best.Result();
}

std::optional<SweptLine> SweepAnyDirection(const LineSegment& segment, int view,
                                           const std::vector<SweepImage>& images,
                                           const ViewCameras& views,
                                           const LineSweepOptions& options) {
  const Eigen::Vector2d along = (segment.end - segment.start).normalized();
  const auto right = std::find_if(images.begin(), images.end(), [&](const SweepImage& image) {
    return image.view == view && image.camera == 1;
  });
  if (right == images.end() || std::abs(along.y()) < kMinTilt) return std::nullopt;
  const RigidTransform T_world_camera = views.T_camera_world[view][0].Inverse();
  const double baseline_m = (views.Centre(view, 1) - views.Centre(view, 0)).norm();
  const double step = kStep_px / (views.cameras[0].fx_px * baseline_m);
  BestLine best;
  const auto at = [&](const Eigen::Vector2d& end, double w) -> Eigen::Vector3d {
    return T_world_camera * (end.homogeneous() / w);
  };
  for (double a = 1 / options.max_depth_m; a < 1 / kSweepMinDepth_m; a += step) {
    for (double b = std::max(1 / options.max_depth_m, 0.5 * a);
         b < std::min(1 / kSweepMinDepth_m, 2 * a); b += step) {
      const Eigen::Vector3d start = at(segment.start, a), end = at(segment.end, b);
      SweptLine swept;
      swept.line = {0.5 * (start + end), (end - start).normalized()};
      const double half_m = 0.5 * (end - start).norm();
      swept.seen = {-half_m, half_m};
      const auto part =
          SeenPart(swept.line, swept.seen, views.T_camera_world[view][1], views.cameras[1], {});
      if (!part || ShareOfEdges(right->edges, part->px) < kSweepMinShare) continue;
      const Support support = MeasureSupport(swept.line, swept.seen, images, views);
      swept.score = support.score;
      best.Offer(0.5 * (a + b), swept, support);
    }
  }
  return best.Result();
}

namespace {

EdgeView ReadEdges(const ViewImages& images, size_t view, double min_gradient,
                   const LineDetectorOptions& detector) {
  EdgeView read;
  read.images = images.Read(view);
  for (const int camera : {0, 1}) {
    if (read.image(camera).empty()) continue;
    read.edges[camera] = EdgeDirections(read.image(camera), min_gradient);
  }
  if (!read.images.left.empty()) {
    read.segments = DetectSegments(read.images.left, images.mask_of(view, 0), detector);
  }
  return read;
}

}  // namespace

EdgeViews MakeEdgeViews(const ViewImages& images, size_t views, double min_gradient,
                        const LineDetectorOptions& detector, int reach) {
  const auto read = [&images, min_gradient, detector](size_t view) {
    return ReadEdges(images, view, min_gradient, detector);
  };
  return EdgeViews(views, read, reach);
}

std::vector<SweepImage> ImagesAround(const EdgeViews& window, int view, const Views& all,
                                     const ViewCameras& cameras) {
  // By how far the baseline is from those taken already, relative to it.
  std::vector<std::pair<double, int>> others;  // baseline and view
  for (const auto& [other, edge_view] : window.kept()) {
    if (other == view || all[other].segment != all[view].segment) continue;
    const double baseline_m = (cameras.Centre(other) - cameras.Centre(view)).norm();
    const double turn_rad = cameras.T_camera_world[other][0].rotation.angularDistance(
        cameras.T_camera_world[view][0].rotation);
    if (baseline_m < kMinBaseline_m || baseline_m > kMaxBaseline_m) continue;
    if (turn_rad < kSweepMaxTurn_rad) others.push_back({baseline_m, other});
  }
  std::sort(others.begin(), others.end());
  std::vector<SweepImage> images;
  const auto add = [&](int v, int camera) {
    const cv::Mat& edges = window.at(v).edges[camera];
    if (!edges.empty()) images.push_back({v, camera, edges});
  };
  add(view, 1);
  const int count = std::min(kMaxViews, static_cast<int>(others.size()));
  for (int i = 0; i < count; ++i) {  // spread evenly over the baselines
    const size_t k = count == 1 ? 0 : i * (others.size() - 1) / (count - 1);
    add(others[k].second, 0);
    add(others[k].second, 1);
  }
  return images;
}

}  // namespace slcmap::mapping
