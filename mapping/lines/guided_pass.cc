#include "mapping/lines/guided_pass.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "data/core/parallel.h"
#include "mapping/lines/line_finder.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_merging.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kBin_m = 0.02;
constexpr double kMaxGap_m = 0.1;             // that is closed, where nothing was observed
constexpr double kIntervalMinLength_m = 0.1;  // of an interval
constexpr int kMinViews = 3;                  // that show a bin's edge
// of the views that look at a bin: not all that hides it is known
constexpr double kIntervalMinShare = 0.4;

constexpr double kUnknown_rad = 1;    // of a direction that places do not tell
constexpr double kRobustSquared = 4;  // squared sigmas off the axis at which a line counts half

// How far a line is off its axis, as its places alone have it, along the axis' `across`.
struct OffAxis {
  size_t line = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d off_rad = Eigen::Vector2d::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();  // its variance but for what lines share
};

// What lines of an axis share of their variance about it, and what is each one's own.
class DeviationModel {
 public:
  DeviationModel(double sigma_rad, const NeighbourOptions& options)
      : variance_(sigma_rad * sigma_rad), options_(options) {}

  double SharedBetween(const Eigen::Vector3d& a_world, const Eigen::Vector3d& b_world) const {
    const double near = std::exp(-(a_world - b_world).norm() / options_.reach_m);
    return variance_ * (options_.building_share + options_.shared_share * near);
  }

  double Variance() const { return variance_; }
  double OwnVariance() const {
    return variance_ * std::max(0.0, 1 - options_.building_share - options_.shared_share);
  }

 private:
  double variance_;
  NeighbourOptions options_;
};

// The information of the direction where the place across is not known: the Schur complement.
Eigen::Matrix2d OfDirection(const Eigen::Matrix4d& information) {
  const Eigen::Matrix2d of_place =
      information.topLeftCorner<2, 2>() + 1e-6 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d mixed = information.topRightCorner<2, 2>();
  return information.bottomRightCorner<2, 2>() - mixed.transpose() * of_place.inverse() * mixed;
}

// With a line's own deviation, and more for one that cannot well be of this axis.
Eigen::Matrix2d ComputeNoise(const Eigen::Vector2d& off_rad, const Eigen::Matrix2d& covariance,
                             const DeviationModel& model) {
  const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d expected = covariance + model.Variance() * unit;
  const double squared_sigmas = off_rad.dot(expected.inverse() * off_rad);
  return (1 + squared_sigmas / kRobustSquared) * (covariance + model.OwnVariance() * unit);
}

// The fit is the mean of what the places and the prior at the axis tell, by their information: this
// takes the prior out of it.
OffAxis ComputeOffAxis(const TrackedLine& line, size_t index, const BuildingAxis& axis,
                       const DeviationModel& model) {
  const Eigen::Matrix<double, 3, 2> across = ComputeAcross(axis.direction_world);
  const double sense = line.line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const Eigen::Vector2d fitted_rad = across.transpose() * (sense * line.line.direction_world);
  const Eigen::Matrix2d turn = across.transpose() * line.fit.across;
  const Eigen::Matrix2d places = turn * OfDirection(line.fit.places_information) * turn.transpose();
  const Eigen::Matrix2d prior = Eigen::Matrix2d::Identity() / model.Variance();
  const Eigen::Matrix2d unknown = Eigen::Matrix2d::Identity() / (kUnknown_rad * kUnknown_rad);
  const Eigen::Matrix2d covariance = (places + unknown).inverse();
  OffAxis off{index, line.line.point_world};
  off.off_rad = covariance * (places + prior) * fitted_rad;
  off.noise = ComputeNoise(off.off_rad, covariance, model);
  return off;
}

// The others, the nearest first.
std::vector<const OffAxis*> NearestTo(const OffAxis& line, const std::vector<OffAxis>& all,
                                      int most) {
  std::vector<std::pair<double, size_t>> others;
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].line == line.line) continue;
    others.emplace_back((all[i].middle_world - line.middle_world).squaredNorm(), i);
  }
  const size_t count = std::min(others.size(), static_cast<size_t>(most));
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                    others.end());
  std::vector<const OffAxis*> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(&all[others[i].second]);
  return nearest;
}

// What the neighbours were measured to be off, its covariance, and that with the line's own.
struct Neighbourhood {
  Eigen::VectorXd off_rad;
  Eigen::MatrixXd covariance, with_line;
};

Neighbourhood MakeNeighbourhood(const OffAxis& line, const std::vector<const OffAxis*>& nearest,
                                const DeviationModel& model) {
  const Eigen::Matrix2d unit = Eigen::Matrix2d::Identity();
  const auto count = static_cast<Eigen::Index>(nearest.size());
  Neighbourhood around{Eigen::VectorXd(2 * count), Eigen::MatrixXd(2 * count, 2 * count),
                       Eigen::MatrixXd(2 * count, 2)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d& middle_world = nearest[i]->middle_world;
    for (Eigen::Index k = 0; k < count; ++k) {
      around.covariance.block<2, 2>(2 * i, 2 * k) =
          model.SharedBetween(middle_world, nearest[k]->middle_world) * unit;
    }
    around.covariance.block<2, 2>(2 * i, 2 * i) += nearest[i]->noise;
    around.with_line.middleRows<2>(2 * i) =
        model.SharedBetween(middle_world, line.middle_world) * unit;
    around.off_rad.segment<2>(2 * i) = nearest[i]->off_rad;
  }
  return around;
}

// The prediction of a Gaussian process that leaves the line itself out.
DirectionPrior Predict(const OffAxis& line, const std::vector<OffAxis>& all,
                       const BuildingAxis& axis, const DeviationModel& model, int max_neighbours) {
  constexpr double kMinShare = 1e-4;  // of the variance, against rounding
  const auto nearest = NearestTo(line, all, max_neighbours);
  if (nearest.empty()) return {axis.direction_world, std::sqrt(model.Variance())};
  const Neighbourhood around = MakeNeighbourhood(line, nearest, model);
  const Eigen::MatrixXd gain = around.covariance.llt().solve(around.with_line).transpose();
  const double known = (gain * around.with_line).trace() / 2;
  const Eigen::Vector2d mean_rad = gain * around.off_rad;
  const Eigen::Vector3d direction =
      axis.direction_world + ComputeAcross(axis.direction_world) * mean_rad;
  const double variance = std::max(model.Variance() - known, kMinShare * model.Variance());
  return {direction.normalized(), std::sqrt(variance)};
}

}  // namespace

std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options) {
  // Segments of a run are shifted and turned against each other.
  std::map<std::pair<int, int>, std::vector<OffAxis>> groups;  // by axis and segment
  for (size_t i = 0; i < lines.size(); ++i) {
    const TrackedLine& line = lines[i];
    if (line.axis < 0) continue;
    const BuildingAxis& axis = axes[line.axis];
    groups[{line.axis, line.segment}].push_back(
        ComputeOffAxis(line, i, axis, DeviationModel(axis.sigma_rad, options)));
  }
  std::vector<std::optional<DirectionPrior>> priors(lines.size());
  for (const auto& [key, all] : groups) {
    const BuildingAxis& axis = axes[key.first];
    const DeviationModel model(axis.sigma_rad, options);
    ParallelFor(all.size(), [&](size_t i) {
      priors[all[i].line] = Predict(all[i], all, axis, model, options.max_neighbours);
    });
  }
  return priors;
}

namespace {

constexpr double kBeyond_m = 1.5;     // past the ends of what is known of a line
constexpr double kMaxReach_m = 0.05;  // a sample that stands for more is seen too nearly end-on
constexpr double kMoved_m = 0.004;    // a line that moved by more is looked for again

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

// How far, at most, a line's intervals are from where a fit has them.
double Moved_m(const TrackedLine& line, const LineFit& fit) {
  double moved_m = 0;
  for (const double along_m : {line.intervals.front().from_m, line.intervals.back().to_m}) {
    const Eigen::Vector3d p = line.line.point_world + along_m * line.line.direction_world;
    moved_m = std::max(moved_m, (p - NearestOn(fit.line, p)).norm());
  }
  return moved_m;
}

// Moves the line to where its fit has it, and what counts along it.
void MoveTo(const LineFit& fit, TrackedLine* line) {
  line->moved_m = Moved_m(*line, fit);
  line->fit = fit;
  line->line = fit.line;
  for (Interval& interval : line->intervals) {
    interval = {interval.from_m - fit.shift_m, interval.to_m - fit.shift_m};
  }
  line->bins_from_m -= fit.shift_m;
  for (EdgePoint& place : line->places) {
    for (float* along_m : {&place.along_m, &place.from_m, &place.to_m}) {
      *along_m = static_cast<float>(*along_m - fit.shift_m);
    }
  }
  line->seen = {line->intervals.front().from_m, line->intervals.back().to_m};
}

IntervalLimits ComputeLimits(const TrackedLine& line, const MapLineOptions& options) {
  return {options.min_views, options.max_sigma_m,
          line.axis < 0 ? options.max_free_spread_px : options.max_spread_px, kIntervalMinLength_m};
}

// Fits a line again to its places in its intervals; false where it does not hold.
bool FitToViews(const ViewCameras& cameras, const std::vector<BuildingAxis>& axes,
                const MapLineOptions& options, TrackedLine* line) {
  line->intervals = FindIntervals(*line);
  DropPlacesOutside(line);
  if (line->intervals.empty()) return false;
  const IntervalLimits limits = ComputeLimits(*line, options);
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

void FitAgain(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
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

void LookAgain(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
               const std::vector<BuildingAxis>& axes, const MapLineOptions& options,
               std::vector<TrackedLine>* lines, const Progress& progress) {
  const auto has_moved = [](const TrackedLine& line) { return line.moved_m > kMoved_m; };
  std::vector<TrackedLine> moved;
  std::ranges::copy_if(*lines, std::back_inserter(moved), has_moved);
  if (moved.empty()) return;
  LookForLines(views, images, depths, options, &moved, progress);
  if (!progress.Report(1)) return;
  FitAgain(views, images.rig(), axes, options, &moved);
  std::erase_if(*lines, has_moved);
  std::ranges::move(moved, std::back_inserter(*lines));
}

void FitAmongNeighbours(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
                        const MapLineOptions& options, std::vector<TrackedLine>* lines) {
  const ViewCameras cameras(views, rig);
  const auto priors = PriorsByNeighbours(*lines, axes, options.neighbours);
  ParallelFor(lines->size(), [&](size_t k) {
    TrackedLine& line = (*lines)[k];
    if (!priors[k]) return;
    const auto fit = FitLine(line.line, line.places, cameras, priors[k], options.fit);
    if (!fit || !ComputeLimits(line, options).Hold(*fit)) return;
    // By more only where lines were merged that are not one.
    if (Moved_m(line, *fit) <= kMergeMaxDistance_m) MoveTo(*fit, &line);
  });
}

}  // namespace slcmap::mapping
