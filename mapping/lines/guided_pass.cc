#include <algorithm>
#include <cmath>
#include <utility>

#include "data/core/parallel.h"
#include "mapping/lines/line_finder.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_merging.h"
#include "mapping/lines/map_lines.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kBin_m = 0.02;
constexpr double kMaxGap_m = 0.1;             // that is closed, where nothing was observed
constexpr double kIntervalMinLength_m = 0.1;  // of an interval
constexpr int kMinViews = 3;                  // that show a bin's edge
// of the views that look at a bin: not all that hides it is known
constexpr double kIntervalMinShare = 0.4;

constexpr double kBeyond_m = 1.5;     // past the ends of what is known of a line
constexpr double kMaxReach_m = 0.05;  // a sample that stands for more is seen too nearly end-on

void StartBins(TrackedLine* line) {
  line->places.clear();
  line->step_sum = line->lasting_sum = line->brightness_sum = 0;
  line->bins_from_m = line->seen.from_m - kBeyond_m;
  const double length_m = line->seen.to_m + kBeyond_m - line->bins_from_m;
  line->bins.assign(static_cast<size_t>(std::ceil(length_m / kBin_m)), BinViews());
}

Interval FindBins(const TrackedLine& line) {
  return {line.bins_from_m, line.bins_from_m + kBin_m * static_cast<double>(line.bins.size())};
}

// The samples that are not hidden, at bins that are near enough for their edge to be told from its
// neighbours.
void KeepClear(const TrackedLine& line, double bin_m, const VisibilityDepths& depths, int view,
               int camera, std::vector<LineSample>* samples) {
  std::erase_if(*samples, [&](const LineSample& sample) {
    if (depths.Hides(view, camera, sample.px, sample.depth_m)) return true;
    const auto bin = static_cast<int>(std::floor((sample.along_m - line.bins_from_m) / bin_m));
    const int last = static_cast<int>(line.bins.size()) - 1;
    return sample.depth_m > line.bins[std::clamp(bin, 0, last)].max_depth_m;
  });
}

// A bin counts a view once, whichever of its images shows it.
void MarkBins(const std::vector<LineSample>& samples, const TrackedLine& line, double bin_m,
              std::vector<char>* looked, std::vector<char>* shown) {
  const auto last = static_cast<int>(line.bins.size()) - 1;
  for (const LineSample& sample : samples) {
    if (sample.reach_m > kMaxReach_m) continue;
    const auto bin_of = [&](double along_m) {
      return static_cast<int>(std::floor((along_m - line.bins_from_m) / bin_m));
    };
    const int from = std::max(0, bin_of(sample.along_m - sample.reach_m + 0.5 * bin_m));
    const int to = std::min(last, bin_of(sample.along_m + sample.reach_m - 0.5 * bin_m));
    for (int i = from; i <= std::max(from, to) && i <= last; ++i) {
      (*looked)[i] = 1;
      if (sample.is_edge) (*shown)[i] = 1;
    }
  }
}

void LookForLine(int view, const StereoImage& pair, const ViewImages& images,
                 const ViewCameras& cameras, const VisibilityDepths& depths,
                 const MapLineOptions& options, TrackedLine* line) {
  const LineSampling sampling{.step_m = kBin_m, .min_gradient = MinGradient(*line)};
  const Interval bins = FindBins(*line);
  std::vector<char> looked, shown;
  for (const int camera : {0, 1}) {
    const cv::Mat& image = camera == 0 ? pair.left : pair.right;
    const auto part = SeenPart(line->line, bins, cameras.T_camera_world[view][camera],
                               cameras.cameras[camera], {.max_depth_m = options.max_depth_m});
    if (!part || image.empty()) continue;
    std::vector<LineSample> samples =
        SampleLine(image, images.mask_of(static_cast<size_t>(view), camera), *part, sampling);
    KeepClear(*line, kBin_m, depths, view, camera, &samples);
    if (looked.empty()) {
      looked.assign(line->bins.size(), 0);
      shown.assign(line->bins.size(), 0);
    }
    MarkBins(samples, *line, kBin_m, &looked, &shown);
    AddPlaces(samples, *part, view, camera, kFitPlaceStep_m, &line->places);
    for (const LineSample& sample : samples) {
      if (!sample.is_edge || sample.along_m < line->seen.from_m ||
          sample.along_m > line->seen.to_m) {
        continue;
      }
      line->step_sum += sample.step;
      line->lasting_sum += sample.lasting_step;
      line->brightness_sum += sample.brightness;
    }
  }
  for (size_t i = 0; i < looked.size(); ++i) {
    line->bins[i].shown = static_cast<uint16_t>(line->bins[i].shown + shown[i]);
    line->bins[i].missed = static_cast<uint16_t>(line->bins[i].missed + (looked[i] && !shown[i]));
  }
}

// From far away neighbouring edges run together: a bin is looked at from where it is not much
// farther than in the view that is nearest to it, of those that it is not hidden from.
void LimitDepths(const Views& views, const ViewCameras& cameras, const VisibilityDepths& depths,
                 const MapLineOptions& options, TrackedLine* line) {
  constexpr float kTimes = 2.2F, kLeast_m = 2.5F;
  constexpr int kBins = 5;  // at once
  const auto limit_m = static_cast<float>(options.max_depth_m);
  const auto count = static_cast<int>(line->bins.size());
  std::vector<float> nearest_m(count / kBins + 1, limit_m);
  const double step_m = kBins * kBin_m;
  for (size_t view = 0; view < views.size(); ++view) {
    if (views[view].segment != line->segment) continue;
    const RigidTransform& T_camera_world = cameras.T_camera_world[view][0];
    const auto part = SeenPart(line->line, FindBins(*line), T_camera_world, cameras.cameras[0],
                               {.max_depth_m = options.max_depth_m});
    if (!part) continue;
    const int from = static_cast<int>((part->from_m - line->bins_from_m) / step_m);
    const int to = static_cast<int>((part->to_m - line->bins_from_m) / step_m);
    for (int i = std::max(0, from); i <= std::min(to, count / kBins); ++i) {
      const double along_m = line->bins_from_m + (i + 0.5) * step_m;
      const Eigen::Vector3d p =
          T_camera_world * (line->line.point_world + along_m * line->line.direction_world);
      if (p.z() <= 0 || p.z() >= nearest_m[i]) continue;
      const Eigen::Vector2d px =
          PixelFromPlane(cameras.cameras[0], Eigen::Vector2d(p.hnormalized()));
      if (depths.Hides(static_cast<int>(view), 0, px, p.z())) continue;
      nearest_m[i] = static_cast<float>(p.z());
    }
  }
  for (int i = 0; i < count; ++i) {
    line->bins[i].max_depth_m = std::clamp(kTimes * nearest_m[i / kBins], kLeast_m, limit_m);
  }
}

// Moves the line to where its fit has it, and what counts along it.
void MoveTo(const LineFit& fit, TrackedLine* line) {
  line->fit = fit;
  line->line = fit.line;
  for (Interval& i : line->intervals) i = {i.from_m - fit.shift_m, i.to_m - fit.shift_m};
  for (EdgePoint& place : line->places) {
    for (float* along_m : {&place.along_m, &place.from_m, &place.to_m}) {
      *along_m = static_cast<float>(*along_m - fit.shift_m);
    }
  }
}

// Fits a line to its places in its intervals; false where it does not hold.
bool FitToViews(const ViewCameras& cameras, const std::vector<BuildingAxis>& axes,
                const MapLineOptions& options, TrackedLine* line) {
  line->intervals = FindIntervals(*line);
  DropPlacesOutside(line);
  if (line->intervals.empty()) return false;
  const IntervalLimits limits = {
      options.min_views, options.max_sigma_m,
      line->axis < 0 ? options.max_free_spread_px : options.max_spread_px, kIntervalMinLength_m};
  const auto fit = FitIntervals(cameras, MakePrior(*line, axes), options.fit, limits, line);
  if (!fit || !limits.Hold(*fit)) return false;
  MoveTo(*fit, line);
  return true;
}

}  // namespace

void LookForLines(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
                  const MapLineOptions& options, std::vector<TrackedLine>* lines,
                  const Progress& progress) {
  constexpr int kAtOnce = 4;  // views in memory
  const ViewCameras cameras(views, images.rig());
  ParallelFor(lines->size(), [&](size_t k) {
    StartBins(&(*lines)[k]);
    LimitDepths(views, cameras, depths, options, &(*lines)[k]);
  });
  const auto count = static_cast<int>(views.size());
  for (int first = 0; first < count; first += kAtOnce) {
    if (!progress.Report(static_cast<double>(first) / count)) return;
    const int some = std::min(kAtOnce, count - first);
    std::vector<StereoImage> pairs(some);
    ParallelFor(some, [&](size_t i) { pairs[i] = images.Read(first + i); });
    ParallelFor(lines->size(), [&](size_t k) {
      TrackedLine& line = (*lines)[k];
      for (int i = 0; i < some; ++i) {
        if (views[first + i].segment != line.segment) continue;
        LookForLine(first + i, pairs[i], images, cameras, depths, options, &line);
      }
    });
  }
}

std::vector<Interval> FindIntervals(const TrackedLine& line) {
  std::vector<Interval> intervals;
  double last_known_m = line.bins_from_m;  // the end of the last bin that is known not to belong
  for (size_t i = 0; i < line.bins.size(); ++i) {
    const double from_m = line.bins_from_m + static_cast<double>(i) * kBin_m;
    const BinViews& bin = line.bins[i];
    const int looked = bin.shown + bin.missed;
    if (looked == 0) continue;
    if (bin.shown < kMinViews || bin.shown < kIntervalMinShare * looked) {
      if (looked >= kMinViews) last_known_m = from_m + kBin_m;
      continue;
    }
    const bool goes_on = !intervals.empty() && last_known_m <= intervals.back().to_m &&
                         from_m - intervals.back().to_m <= kMaxGap_m;
    if (goes_on) {
      intervals.back().to_m = from_m + kBin_m;
    } else {
      intervals.push_back({from_m, from_m + kBin_m});
    }
  }
  std::erase_if(intervals, [&](const Interval& interval) {
    return interval.length_m() < kIntervalMinLength_m;
  });
  return intervals;
}

void FitLines(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
              const MapLineOptions& options, std::vector<TrackedLine>* lines) {
  const ViewCameras cameras(views, rig);
  std::vector<char> holds(lines->size());
  ParallelFor(lines->size(),
              [&](size_t k) { holds[k] = FitToViews(cameras, axes, options, &(*lines)[k]); });
  std::vector<TrackedLine> kept;
  for (size_t k = 0; k < lines->size(); ++k) {
    if (holds[k]) kept.push_back(std::move((*lines)[k]));
  }
  *lines = std::move(kept);
}

}  // namespace slcmap::mapping
