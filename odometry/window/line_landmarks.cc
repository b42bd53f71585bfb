#include "odometry/window/line_landmarks.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "odometry/window/landmark_information.h"
#include "odometry/window/line_priors.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap::inline odometry {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr int kMinKeyframes = 2;  // keyframes that saw a line before it is estimated
// Two lines of one axis are one where their distance is within so many standard deviations of
// their places against each other, or below a least distance (conditional covariances make little
// of what the lines share with the poses), and never above the largest: jambs of doors are 5 to
// 8 cm wide.
constexpr double kMergeSigmas = 3;
constexpr double kMinMergeDistance_m = 0.015;
constexpr double kMaxMergeDistance_m = 0.04;
constexpr double kMaxApartSigmas = 10;  // of sigma_px: seen side by side in one image they are two

// What all observations of the line agree on; nothing where they do not.
std::optional<LineClass> AgreedClass(const LineLandmark& line,
                                     const std::vector<std::optional<double>>& headings,
                                     const LineClassifier& classifier, const CostModel& model) {
  std::optional<LineClass> agreed;
  for (const FrameState* frame : line.frames) {
    const StereoLineMeasurement& seen = frame->lines.at(line.id);
    const auto now = classifier.Classify(
        seen.left, WorldFromCamera(*frame, model.geometry, seen.camera).rotation.toRotationMatrix(),
        headings);
    if (!now || (agreed && !(*agreed == *now))) return std::nullopt;
    agreed = now;
  }
  return agreed;
}

struct KnownPoint {
  int64_t id = 0;
  Vector3d p_world;
};

// A well known point that belongs to the line, if there is one.
std::optional<KnownPoint> FindKnownPoint(const LineLandmarkOptions& options,
                                         const std::vector<int64_t>& members,
                                         const CostModel& model, const WindowState& window) {
  const double limit_m2 = options.max_member_sigma_m * options.max_member_sigma_m;
  for (const int64_t id : members) {
    const auto it = window.landmarks.find(id);
    if (it == window.landmarks.end() || !it->second.triangulated) continue;
    const auto place = PlaceByObservations(it->second, model);
    if (!place || !IsAtRest(*place) || place->covariance_m2.trace() > limit_m2) continue;
    return KnownPoint{id, place->p_world};
  }
  return std::nullopt;
}

// By how much an observation may misfit a line that was laid exactly along its axis, and may
// deviate from it.
double Chi2OfDeviation(const LineLandmark& line, const FrameState& frame, const CostModel& model) {
  constexpr double kSigmas = 3;
  const double off = 0.5 * frame.lines.at(line.id).left.Length() * kSigmas *
                     line.deviation_sigma_rad * model.lines.weight;
  return 2 * off * off;
}

std::optional<StructuralLineFit> FitToViews(const LineLandmarkOptions& options,
                                            const CostModel& model, const LineLandmark& line) {
  return TriangulateStructuralLine(CollectObservations(line), line.structural(), line.heading_rad(),
                                   model.Corrected(model.lines), options.triangulation);
}

// From the views; where these do not tell, from a point.
bool EstimateStructural(const LineLandmarkOptions& options, const std::vector<int64_t>& members,
                        const CostModel& model, const WindowState& window, LineLandmark* line) {
  StructuralLineBlock block;
  line->placed_by.reset();
  if (const auto from_views = FitToViews(options, model, *line)) {
    block = from_views->block;
  } else if (const auto point = FindKnownPoint(options, members, model, window)) {
    block = StructuralLineThrough(line->structural(), line->heading_rad(), point->p_world);
    line->placed_by = point->id;
  } else {
    return false;
  }
  if (line->IsExact()) {
    std::copy(block.begin(), block.end(), line->block.begin());
  } else {
    line->block = GeneralLineThrough(
        line->anchor_world, CrossingPoint(line->structural(), line->heading_rad(), block.data()),
        AxisDirection(line->axis, line->heading_rad()));
  }
  return FitsItsObservations(*line, options.max_new_chi2, model);
}

bool EstimateGeneral(const LineLandmarkOptions& options, const CostModel& model,
                     LineLandmark* line) {
  const auto fit = TriangulateGeneralLine(CollectObservations(*line), line->anchor_world,
                                          model.Corrected(model.lines), options.triangulation);
  if (!fit) return false;
  line->block = fit->block;
  return FitsItsObservations(*line, options.max_new_chi2, model);
}

void RemoveObservation(LineLandmark* line, FrameState* frame) {
  std::erase(line->frames, frame);
  frame->lines.erase(line->id);
}

// Rejects what a frame saw of the line in a camera where it is too far off: in the right one that
// alone, in the left one all. The left one's squared residual where that is kept.
std::optional<double> RejectMisfit(double max_chi2, const CostModel& model, LineLandmark* line,
                                   FrameState* frame) {
  const auto [left, right] = ObservationChi2(*line, *frame, model);
  if (left > max_chi2) {
    RemoveObservation(line, frame);
    return std::nullopt;
  }
  if (right > max_chi2) frame->lines.at(line->id).right.reset();
  return left;
}

// Whether the observations misfit alike: those of a line that is nearly along an axis do, though
// none of them by much.
bool MisfitsAll(double max_median_chi2, std::vector<double> chi2) {
  constexpr size_t kMinObservations = 3;
  if (chi2.size() < kMinObservations) return false;
  const auto median = chi2.begin() + (chi2.size() - 1) / 2;
  std::nth_element(chi2.begin(), median, chi2.end());
  return *median > max_median_chi2;
}

// Beyond infinity, or through the place that it was first seen from.
bool IsBehindAnchor(const LineLandmark& line) {
  if (line.IsExact()) return line.block[1] <= 0;
  return !(line.block[4] > 0 && line.block[4] < M_PI_2);
}

// How far along a line the point of another one of its class is that is nearest to that one's
// anchor: what its extent is counted from.
double AlongFrom(const PointAndDirection& line, const PointAndDirection& other) {
  return line.direction_world.dot(other.point_world - line.point_world);
}

// Whether an image shows the segments side by side, further apart than a limit on z = 1.
bool AreSideBySide(const LineSegment& a, const LineSegment& b, double max_apart) {
  const Vector2d along = (a.end - a.start).normalized(), across(-along.y(), along.x());
  const double from = along.dot(b.start - a.start), to = along.dot(b.end - a.start);
  const double low = std::max(0.0, std::min(from, to));
  const double high = std::min(a.Length(), std::max(from, to));
  if (low >= high) return false;
  const double share = (0.5 * (low + high) - from) / (to - from);
  const Vector2d beside = b.start + share * (b.end - b.start);
  return std::abs(across.dot(beside - a.start)) > max_apart;
}

// Whether a frame saw both as different edges.
bool AreSeenApart(const LineLandmark& a, const LineLandmark& b, double max_apart) {
  return std::any_of(a.frames.begin(), a.frames.end(), [&](const FrameState* frame) {
    const StereoLineMeasurement& of_a = frame->lines.at(a.id);
    const auto of_b = frame->lines.find(b.id);
    return of_b != frame->lines.end() && of_a.camera == of_b->second.camera &&
           AreSideBySide(of_a.left, of_b->second.left, max_apart);
  });
}

// Whether two lines of the same class are the same edge: their distance is what the uncertainty of
// their places may be taken for, and they have a part in common.
bool IsSameEdge(const LineLandmark& a, const LineLandmark& b, const CostModel& model,
                const Prior& prior) {
  const PointAndDirection in_a = a.InWorld(), in_b = b.InWorld();
  // Those that were estimated before they followed a slope may run either way.
  if (in_a.direction_world.dot(in_b.direction_world) < 0) return false;
  const double along_m = AlongFrom(in_a, in_b);
  const double from_m = std::max(a.extent.from_m(), b.extent.from_m() + along_m);
  const double to_m = std::min(a.extent.to_m(), b.extent.to_m() + along_m);
  if (from_m >= to_m) return false;
  const Vector3d middle = in_a.point_world + 0.5 * (from_m + to_m) * in_a.direction_world;
  const Vector3d apart = NearestOn(in_b, middle) - middle;
  const double distance_m = apart.norm();
  if (distance_m > kMaxMergeDistance_m) return false;
  if (AreSeenApart(a, b, kMaxApartSigmas / model.lines.weight)) return false;
  if (distance_m <= kMinMergeDistance_m) return true;
  const Eigen::Matrix3d covariance_m2 = ConditionalCovarianceAcross(a, middle, model, prior) +
                                        ConditionalCovarianceAcross(b, middle, model, prior);
  const double sigma_m = std::sqrt(apart.dot(covariance_m2 * apart)) / distance_m;
  return distance_m <= kMergeSigmas * sigma_m;
}

// The older line takes over the observations of frames in which it was not seen itself, how far it
// was seen, and the points.
void TakeOver(LineLandmark* older, LineLandmark* newer) {
  for (FrameState* frame : newer->frames) {
    if (!frame->lines.try_emplace(older->id, frame->lines.at(newer->id)).second) continue;
    older->frames.push_back(frame);
  }
  std::sort(older->frames.begin(), older->frames.end(),
            [](const FrameState* a, const FrameState* b) { return a->id < b->id; });
  for (const int64_t id : newer->points) {
    if (std::find(older->points.begin(), older->points.end(), id) == older->points.end()) {
      older->points.push_back(id);
    }
  }
  const std::vector<int64_t> released = std::move(older->released_frames);
  older->released_frames.clear();
  std::set_union(released.begin(), released.end(), newer->released_frames.begin(),
                 newer->released_frames.end(), std::back_inserter(older->released_frames));
  older->extent.Add(newer->extent, AlongFrom(older->InWorld(), newer->InWorld()));
}

}  // namespace

RigidTransform WorldFromCamera(const FrameState& frame, const StereoGeometry& geometry,
                               int camera) {
  return frame.T_world_imu() * geometry.T_imu_camera[camera];
}

std::vector<PosedLineObservation> CollectObservations(const LineLandmark& line) {
  std::vector<PosedLineObservation> observations;
  for (const FrameState* frame : line.frames) {
    observations.push_back({frame->T_world_imu(), frame->lines.at(line.id)});
  }
  return observations;
}

bool FitsItsObservations(const LineLandmark& line, double max_new_chi2, const CostModel& model) {
  int good = 0;
  for (const FrameState* frame : line.frames) {
    const double max_chi2 = max_new_chi2 + Chi2OfDeviation(line, *frame, model);
    const auto [left, right] = ObservationChi2(line, *frame, model);
    good += left <= max_chi2 && right <= max_chi2;
  }
  // One in four may be a wrong match, and is rejected later.
  return 4 * good >= 3 * static_cast<int>(line.frames.size());
}

void Retire(LineLandmark* line) {
  for (FrameState* frame : line->frames) frame->lines.erase(line->id);
  line->frames.clear();
  line->points.clear();
  line->retired = true;
}

void RegisterLines(FrameState* frame, WindowState* window) {
  std::erase_if(frame->lines, [&](const auto& entry) {
    const auto known = window->lines.find(entry.first);
    return known != window->lines.end() && known->second.finished;
  });
  for (const auto& [id, measurement] : frame->lines) {
    LineLandmark& line = window->lines[id];
    line.id = id;
    line.camera = measurement.camera;
    line.frames.push_back(frame);
  }
}

void EstimateLines(const LineLandmarkOptions& options, const LineKinds& kinds,
                   const LineClassifier& classifier, const PointsOnLines& memberships,
                   const LineDeviations& deviations, const CostModel& model, WindowState* window) {
  const std::vector<std::optional<double>> headings = CollectHeadings(*window);
  for (auto& [id, line] : window->lines) {
    if (line.estimated || line.retired) continue;
    if (static_cast<int>(line.frames.size()) < kMinKeyframes) continue;
    if (!options.anchor_at_origin) {
      line.anchor_world =
          WorldFromCamera(*line.frames.front(), model.geometry, line.camera).translation;
    }
    const auto agreed =
        kinds.structural ? AgreedClass(line, headings, classifier, model) : std::nullopt;
    if (agreed) {
      line.axis = agreed->axis;
      line.deviation_sigma_rad = deviations.Of(line.axis).OfNewLine(id);
      line.heading =
          agreed->axis == LineAxis::kVertical ? nullptr : &window->headings[agreed->world];
      line.estimated =
          EstimateStructural(options, memberships.CollectPoints(id), model, *window, &line);
    } else if (kinds.general &&
               static_cast<int>(line.frames.size()) >= kLandmarkMinGeneralKeyframes) {
      line.estimated = EstimateGeneral(options, model, &line);
    }
    if (line.estimated) continue;
    line.axis = LineAxis::kNone;
    line.heading = nullptr;
    line.placed_by.reset();
  }
}

std::unordered_set<int64_t> RetireMisplaced(const LineLandmarkOptions& options,
                                            const std::unordered_set<int64_t>& ids,
                                            const CostModel& model, WindowState* window) {
  std::unordered_set<int64_t> retired;
  for (auto& [id, line] : window->lines) {
    if (!ids.contains(id)) continue;
    line.placed_by.reset();
    if (!line.frames.empty() && FitToViews(options, model, line)) continue;
    Retire(&line);
    retired.insert(id);
  }
  return retired;
}

std::pair<double, double> ObservationChi2(const LineLandmark& line, const FrameState& frame,
                                          const CostModel& model) {
  return Chi2OfObservation(FixedLineTerm(line, frame, model));
}

void RejectLineMisfits(const LineLandmarkOptions& options, const CostModel& model,
                       FrameState* frame, WindowState* window) {
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !frame->lines.contains(id)) continue;
    RejectMisfit(options.max_tracking_chi2, model, &line, frame);
  }
}

std::unordered_set<int64_t> RejectLineOutliers(const LineLandmarkOptions& options,
                                               const LineDeviations& deviations,
                                               const CostModel& model, WindowState* window) {
  std::unordered_set<int64_t> outliers;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired) continue;
    std::vector<double> kept;
    const std::vector<FrameState*> frames = line.frames;
    for (FrameState* frame : frames) {
      const auto left = RejectMisfit(options.max_chi2, model, &line, frame);
      if (left) kept.push_back(*left);
    }
    const bool fits =
        2 * kept.size() >= frames.size() && !MisfitsAll(options.max_median_chi2, std::move(kept));
    const bool off_axis =
        !line.slope && IsOffAxis(line, deviations.Of(line.axis).max_deviation_rad());
    if (fits && !IsBehindAnchor(line) && !off_axis) continue;
    outliers.insert(id);
    Retire(&line);
  }
  return outliers;
}

std::unordered_set<int64_t> RejectHeadings(WindowState* window) {
  const auto name = [](const HeadingState& heading) {
    return fmt::format("Manhattan world {}, heading {:.2f} degrees", heading.world,
                       heading.heading_rad[0] * 180 / M_PI);
  };
  return RejectFollowed(kMinGivenUpOfHeading, &LineLandmark::heading, &window->headings, name,
                        window);
}

std::map<int64_t, int64_t> MergeLines(const CostModel& model, WindowState* window) {
  std::map<int64_t, int64_t> merged;
  const auto mergeable = [](const LineLandmark& line) {
    return line.estimated && !line.retired && !line.finished && line.IsStructural() &&
           !line.extent.empty();
  };
  for (auto a = window->lines.begin(); a != window->lines.end(); ++a) {
    if (!mergeable(a->second)) continue;
    for (auto b = std::next(a); b != window->lines.end(); ++b) {
      if (!mergeable(b->second) || a->second.axis != b->second.axis ||
          a->second.heading != b->second.heading || a->second.slope != b->second.slope ||
          !IsSameEdge(a->second, b->second, model, window->prior)) {
        continue;
      }
      TakeOver(&a->second, &b->second);
      Retire(&b->second);
      merged.emplace(b->first, a->first);
    }
  }
  return merged;
}

void ExtendLines(const FrameState& newest, const CostModel& model, WindowState* window) {
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired) continue;
    const bool is_new = line.extent.empty();
    for (const FrameState* frame : line.frames) {
      if (!is_new && frame != &newest) continue;
      const StereoLineMeasurement& seen = frame->lines.at(id);
      const auto interval = ExtentAlong(line.InWorld(), seen.left,
                                        WorldFromCamera(*frame, model.geometry, seen.camera));
      if (interval) line.extent.Add(interval->first, interval->second);
    }
  }
}

Vector3d ComputeMiddle(const LineLandmark& line) {
  const PointAndDirection in_world = line.InWorld();
  return in_world.point_world +
         0.5 * (line.extent.from_m() + line.extent.to_m()) * in_world.direction_world;
}

Line Describe(const LineLandmark& line) {
  const PointAndDirection in_world = line.InWorld();
  Line out;
  out.id = line.id;
  out.axis = line.axis;
  if (line.heading) out.world = line.heading->world;
  if (line.slope) out.world = line.slope->index;
  out.start_world = in_world.point_world + line.extent.from_m() * in_world.direction_world;
  out.end_world = in_world.point_world + line.extent.to_m() * in_world.direction_world;
  out.observations = static_cast<int>(line.frames.size() + line.released_frames.size());
  out.last_keyframe = line.last_seen_frame();
  out.point_ids = line.points;
  return out;
}

}  // namespace slcmap::odometry
