#include "mapping/lines/line_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/lines/edge_directions.h"
#include "odometry/frontend/line_geometry.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap {
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

Support SupportOf(const PointAndDirection& line, const Stretch& seen,
                  const std::vector<SweepImage>& images, const ViewCameras& views,
                  const LineSweepOptions& options) {
  constexpr double kMinLength_px = 8, kMissCost = 0.35;
  Support support;
  for (const SweepImage& image : images) {
    const auto part = SeenPart(line, seen, views.T_camera_world[image.view][image.camera],
                               views.cameras[image.camera], {});
    if (!part || part->px.Length() < kMinLength_px) continue;
    if (part->to_m - part->from_m < 0.5 * (seen.to_m - seen.from_m)) continue;
    const double share = ShareOfEdges(image.edges, part->px);
    if (share >= options.min_share) {
      ++support.images;
      support.score += share;
    } else {
      support.score -= kMissCost * (1 - share);
    }
  }
  return support;
}

// The stretch of a line between the rays of a segment's ends, with the line running as the segment.
std::optional<Stretch> StretchOf(PointAndDirection* line, const LineSegment& segment,
                                 const RigidTransform& T_world_camera) {
  const auto extent = ExtentAlong(*line, segment, T_world_camera);
  if (!extent) return std::nullopt;
  const Eigen::Vector3d step = T_world_camera.rotation.conjugate() * line->direction_world;
  const Eigen::Vector3d p = T_world_camera.Inverse() * line->point_world;
  const Eigen::Vector2d moved = (p + 1e-3 * step).hnormalized() - p.hnormalized();
  if (moved.dot(segment.end - segment.start) >= 0) return Stretch{extent->first, extent->second};
  line->direction_world = -line->direction_world;
  return Stretch{-extent->second, -extent->first};
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
  std::optional<SweptLine> Result(const LineSweepOptions& options) const {
    if (!best_ || images_ < options.min_images) return std::nullopt;
    double below = -1, above = std::numeric_limits<double>::infinity();  // where it has fallen
    for (const auto& [inverse_depth, score] : scores_) {
      if (score > 0.5 * best_->score) continue;
      if (inverse_depth < peak_) below = std::max(below, inverse_depth);
      if (inverse_depth > peak_) above = std::min(above, inverse_depth);
    }
    for (const auto& [inverse_depth, score] : scores_) {
      const bool is_beyond = inverse_depth < below || inverse_depth > above;
      if (is_beyond && score > (1 - options.min_lead) * best_->score) return std::nullopt;
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
  if (parallax_m < options.min_parallax_m) return std::nullopt;
  const double step = options.step_px / (views.cameras[0].fx_px * parallax_m);
  BestLine best;
  for (double w = 1 / options.max_depth_m; w < 1 / options.min_depth_m; w += step) {
    SweptLine swept;
    swept.line = {T_world_camera * (ray / w), direction_world};
    const auto seen = StretchOf(&swept.line, segment, T_world_camera);
    if (!seen) continue;
    swept.seen = *seen;
    const Support support = SupportOf(swept.line, swept.seen, images, views, options);
    swept.score = support.score;
    best.Offer(w, swept, support);
  }
  return best.Result(options);
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
  const double step = options.step_px / (views.cameras[0].fx_px * baseline_m);
  BestLine best;
  const auto at = [&](const Eigen::Vector2d& end, double w) -> Eigen::Vector3d {
    return T_world_camera * (end.homogeneous() / w);
  };
  for (double a = 1 / options.max_depth_m; a < 1 / options.min_depth_m; a += step) {
    for (double b = std::max(1 / options.max_depth_m, 0.5 * a);
         b < std::min(1 / options.min_depth_m, 2 * a); b += step) {
      const Eigen::Vector3d start = at(segment.start, a), end = at(segment.end, b);
      SweptLine swept;
      swept.line = {0.5 * (start + end), (end - start).normalized()};
      const double half_m = 0.5 * (end - start).norm();
      swept.seen = {-half_m, half_m};
      const auto part =
          SeenPart(swept.line, swept.seen, views.T_camera_world[view][1], views.cameras[1], {});
      if (!part || ShareOfEdges(right->edges, part->px) < options.min_share) continue;
      const Support support = SupportOf(swept.line, swept.seen, images, views, options);
      swept.score = support.score;
      best.Offer(0.5 * (a + b), swept, support);
    }
  }
  return best.Result(options);
}

}  // namespace slcmap
