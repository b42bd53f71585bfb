#include "mapping/lines/line_finder.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "data/core/parallel.h"
#include "data/source/asl_files.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap::inline mapping {
namespace {

constexpr int kMaxSegments = 1000;         // of an image, the longest; halls show 700
constexpr double kMinGradient = 2.5;       // grey values a pixel, of an edge
constexpr double kMinGradientShare = 0.4;  // of what a line's edge has where it was found
// of a segment's ends from an axis' image through its middle
constexpr double kAxisDistance_px = 1.8;
constexpr double kExplained_px = 1.8;  // of a segment's ends from the image of a line that is known
constexpr double kMaxFoundSigma_m = 0.06;  // across a line that is looked for in all views
constexpr double kLevelSigma_rad = 0.005;  // of level lines without an axis

constexpr int kReach = 12;              // views to either side that a segment is looked for in
constexpr double kExplainBeyond_m = 1;  // past the ends of what is known of a line

// Whether a segment runs along the image of a direction through its middle.
bool MayFollow(const LineSegment& px, const Eigen::Vector3d& direction_camera, const Camera& camera,
               double max_distance_px) {
  const Eigen::Vector2d middle = px.Midpoint();
  const Eigen::Vector3d ray = PlaneFromPixel(camera, middle).homogeneous();
  const Eigen::Vector3d moved = ray + 1e-3 * direction_camera;
  const Eigen::Vector2d along =
      PixelFromPlane(camera, Eigen::Vector2d(moved.hnormalized())) - middle;
  if (along.norm() < 1e-9) return false;  // towards the camera
  const Eigen::Vector2d half = px.end - middle, unit = along.normalized();
  return std::abs(half.x() * unit.y() - half.y() * unit.x()) <= max_distance_px;
}

// Whether a segment lies on the image of a line, the same way round, for at least half its length.
bool LiesOn(const LineSegment& segment, const LineSegment& line, double max_distance_px) {
  const Eigen::Vector2d direction = Direction(line);
  if (direction.dot(Direction(segment)) < 0.98) return false;
  if (std::abs(DistanceAcross_px(line, segment.start)) > max_distance_px ||
      std::abs(DistanceAcross_px(line, segment.end)) > max_distance_px) {
    return false;
  }
  return Overlap_px(line, segment) >= 0.5 * segment.Length();
}

void Lengthen(const Interval& by, Interval* interval) {
  interval->from_m = std::min(interval->from_m, by.from_m);
  interval->to_m = std::max(interval->to_m, by.to_m);
}

// Moves the origin of the line's places along it to where its fit has it.
void Take(const LineFit& fit, TrackedLine* line) {
  line->fit = fit;
  line->line = fit.line;
  line->seen.from_m -= fit.shift_m;
  line->seen.to_m -= fit.shift_m;
}

LineDetectorOptions MakeDetectorOptions(const MapLineOptions& options) {
  LineDetectorOptions detector;
  detector.scale = 1;
  detector.min_length_px = options.min_segment_px;
  detector.max_join_gap_px = 3;
  detector.max_segments = kMaxSegments;
  return detector;
}

}  // namespace

double MinGradient(const TrackedLine& line) {
  return std::max(kMinGradient, kMinGradientShare * line.gradient);
}

std::optional<DirectionPrior> MakePrior(const TrackedLine& line,
                                        const std::vector<BuildingAxis>& axes) {
  if (line.is_level) {
    return DirectionPrior{Eigen::Vector3d::UnitZ(), kLevelSigma_rad, true};
  }
  if (line.axis < 0) return std::nullopt;
  return DirectionPrior{axes[line.axis].direction_world, axes[line.axis].sigma_rad};
}

LineFinder::LineFinder(const Views& views, const ViewImages& images,
                       const std::vector<BuildingAxis>& axes, const MapLineOptions& options)
    : views_(views),
      images_(images),
      axes_(axes),
      options_(options),
      cameras_(views, images.rig()),
      window_(MakeEdgeViews(images, views.size(), kMinGradient, MakeDetectorOptions(options),
                            kReach)) {}

std::vector<TrackedLine> LineFinder::Find(std::vector<TrackedLine> known,
                                          const Progress& progress) {
  lines_ = std::move(known);
  const auto count = static_cast<double>(views_.size());
  for (size_t view = 0; view < views_.size(); ++view) {
    if (!progress.Report(static_cast<double>(view) / count)) break;
    window_.MoveTo(static_cast<int>(view));
    LookAt(static_cast<int>(view));
  }
  return std::move(lines_);
}

void LineFinder::LookAt(int view) {
  if (window_.at(view).images.left.empty()) return;
  const std::vector<LineSegment>& segments = window_.at(view).segments;
  std::vector<char> explained(segments.size(), 0);
  Explain(view, segments, 0, &explained);
  const std::vector<SweepImage> images = ImagesAround(window_, view, views_, cameras_);
  std::vector<std::optional<TrackedLine>> found(segments.size());
  ParallelFor(segments.size(), [&](size_t i) {
    if (explained[i]) return;
    const std::optional<Hypothesis> hypothesis = Sweep(segments[i], view, images);
    if (hypothesis) found[i] = Accept(*hypothesis, view, images);
  });
  for (size_t i = 0; i < segments.size(); ++i) {
    if (!found[i] || explained[i]) continue;
    lines_.push_back(std::move(*found[i]));
    Explain(view, segments, lines_.size() - 1, &explained);
  }
}

void LineFinder::Explain(int view, const std::vector<LineSegment>& segments, size_t first_line,
                         std::vector<char>* explained) {
  const RigidTransform& T_camera_world = cameras_.T_camera_world[view][0];
  const Camera& camera = cameras_.cameras[0];
  const ViewLimits limits{.max_depth_m = options_.max_depth_m};
  for (size_t k = first_line; k < lines_.size(); ++k) {
    TrackedLine& line = lines_[k];
    if (line.segment != views_[view].segment) continue;
    const Interval longer{line.seen.from_m - kExplainBeyond_m, line.seen.to_m + kExplainBeyond_m};
    const auto part = SeenPart(line.line, longer, T_camera_world, camera, limits);
    if (!part) continue;
    for (size_t i = 0; i < segments.size(); ++i) {
      if (!LiesOn(segments[i], part->px, kExplained_px)) continue;
      (*explained)[i] = 1;
      const auto extent =
          ExtentAlong(line.line, PlaneFromPixel(camera, segments[i]), T_camera_world.Inverse());
      if (extent) Lengthen({extent->first, extent->second}, &line.seen);
    }
  }
}

std::optional<LineFinder::Hypothesis> LineFinder::Sweep(
    const LineSegment& px, int view, const std::vector<SweepImage>& images) const {
  const Eigen::Quaterniond& R_camera_world = cameras_.T_camera_world[view][0].rotation;
  const LineSegment segment = PlaneFromPixel(cameras_.cameras[0], px);
  std::optional<Hypothesis> best;
  for (size_t i = 0; i < axes_.size(); ++i) {
    const BuildingAxis& axis = axes_[i];
    if (axis.segment >= 0 && axis.segment != views_[view].segment) continue;
    if (!MayFollow(px, R_camera_world * axis.direction_world, cameras_.cameras[0],
                   kAxisDistance_px)) {
      continue;
    }
    const auto swept =
        SweepAlongAxis(segment, view, axis.direction_world, images, cameras_, options_.sweep);
    if (swept && (!best || swept->score > best->swept.score)) {
      best = Hypothesis{static_cast<int>(i), false, *swept};
    }
  }
  if (best) return best;
  best = SweepLevel(segment, view, images);
  const auto swept = SweepAnyDirection(segment, view, images, cameras_, options_.sweep);
  if (swept && (!best || swept->score > best->swept.score)) best = Hypothesis{-1, false, *swept};
  return best;
}

// What stands about in a building is turned against it, but level: of all lines that a segment may
// be an image of, those that are level have one direction, however far away.
std::optional<LineFinder::Hypothesis> LineFinder::SweepLevel(
    const LineSegment& segment, int view, const std::vector<SweepImage>& images) const {
  constexpr double kMinLean = 0.1;  // sine of what the plane of camera and segment is off the level
  const Eigen::Quaterniond R_world_camera = cameras_.T_camera_world[view][0].rotation.conjugate();
  const Eigen::Vector3d normal_camera =
      segment.start.homogeneous().cross(segment.end.homogeneous()).normalized();
  const Eigen::Vector3d level = (R_world_camera * normal_camera).cross(Eigen::Vector3d::UnitZ());
  if (level.norm() < kMinLean) return std::nullopt;
  const auto swept =
      SweepAlongAxis(segment, view, level.normalized(), images, cameras_, options_.sweep);
  return swept ? std::optional(Hypothesis{-1, true, *swept}) : std::nullopt;
}

double LineFinder::GradientIn(int view, const TrackedLine& line) const {
  const auto part = SeenPart(line.line, line.seen, cameras_.T_camera_world[view][0],
                             cameras_.cameras[0], {.max_depth_m = options_.max_depth_m});
  if (!part) return 0;
  std::vector<double> gradients;
  const cv::Mat& mask = images_.mask_of(static_cast<size_t>(view), 0);
  for (const LineSample& sample :
       SampleLine(window_.at(view).images.left, mask, *part, {.min_gradient = kMinGradient})) {
    if (sample.is_edge) gradients.push_back(sample.gradient);
  }
  return Median(std::move(gradients));
}

std::optional<TrackedLine> LineFinder::Accept(const Hypothesis& hypothesis, int view,
                                              const std::vector<SweepImage>& images) const {
  constexpr double kMinShown = 0.5, kMaxRms_px = 1.2;
  TrackedLine line;
  line.axis = hypothesis.axis;
  line.is_level = hypothesis.is_level;
  line.segment = views_[view].segment;
  line.line = hypothesis.swept.line;
  line.seen = hypothesis.swept.seen;
  std::vector<SweepImage> all = images;
  all.push_back({view, 0, cv::Mat()});
  line.gradient = GradientIn(view, line);
  for (const double reach_px : {2.5, 1.5}) {
    const LineSampling sampling{.reach_px = reach_px, .min_gradient = MinGradient(line)};
    std::vector<EdgePoint> places;
    size_t shown = 0, looked = 0;
    for (const SweepImage& image : all) {
      const auto part =
          SeenPart(line.line, line.seen, cameras_.T_camera_world[image.view][image.camera],
                   cameras_.cameras[image.camera], {.max_depth_m = options_.max_depth_m});
      if (!part) continue;
      const std::vector<LineSample> samples = SampleLine(
          window_.at(image.view).image(image.camera),
          images_.mask_of(static_cast<size_t>(image.view), image.camera), *part, sampling);
      looked += samples.size();
      for (const LineSample& sample : samples) shown += sample.is_edge;
      AddPlaces(samples, *part, image.view, image.camera, kFitPlaceStep_m, &places);
    }
    const auto fit = FitLine(line.line, places, cameras_, MakePrior(line, axes_), options_.fit);
    if (!fit || static_cast<double>(shown) < kMinShown * static_cast<double>(looked)) {
      return std::nullopt;
    }
    Take(*fit, &line);
  }
  // Of a line without an axis four numbers are to be found instead of two.
  const int min_views = (line.axis < 0 ? 2 : 1) * options_.min_views;
  if (line.fit.views < min_views || line.fit.rms_px > kMaxRms_px) return std::nullopt;
  if (line.fit.sigma_m() > kMaxFoundSigma_m) return std::nullopt;
  return line;
}

}  // namespace slcmap::mapping
