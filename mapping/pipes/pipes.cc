#include "mapping/pipes/pipes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "data/core/parallel.h"
#include "mapping/lines/line_merging.h"
#include "mapping/pipes/outline_pairs.h"
#include "mapping/pipes/pipe_evidence.h"
#include "mapping/pipes/pipe_finder.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kMaxGap_m = 0.5;  // in a pipe
constexpr double kOutlineSigmas = 2;

struct JudgedPipe {
  const PipeCandidate* candidate = nullptr;
  RayEvidence rays;
  double surface_off =
      0;  // in radii; 0 where widths tell it, for which the cloud may be too coarse

  // Some of a pipe's outlines, or with those of another, may make a pipe that is askew: of those
  // that share lines the one that is seen most, and as round as the cloud is.
  double Weight() const { return rays.both_images * (1 - std::min(1.0, surface_off)); }
};

RaysOfLines CollectRays(const PipeCandidate& candidate, const std::vector<Outline>& outlines) {
  RaysOfLines rays;
  for (const size_t i : candidate.outlines) rays.push_back(&outlines[i].rays);
  return rays;
}

// The pieces of an outline, along the axis of a pipe.
std::vector<Interval> PiecesAlong(const PointAndDirection& axis, const Outline& outline) {
  const PointAndDirection& line = outline.line;
  const double sense = line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const double middle_m = axis.direction_world.dot(line.point_world - axis.point_world);
  std::vector<Interval> pieces;
  for (const Interval& piece : outline.pieces) {
    const double a_m = middle_m + sense * piece.from_m, b_m = middle_m + sense * piece.to_m;
    pieces.push_back({std::min(a_m, b_m), std::max(a_m, b_m)});
  }
  return pieces;
}

// How far from the axis a line is at its ends and in the middle.
std::array<double, 3> DistancesFromAxis_m(const Cylinder& cylinder, const Outline& outline) {
  std::array<double, 3> distances_m;
  const double half_m[3] = {-outline.half_m, 0, outline.half_m};
  for (int i = 0; i < 3; ++i) {
    const Vector3d p = outline.line.point_world + half_m[i] * outline.line.direction_world;
    distances_m[i] = (p - cylinder.axis.point_world).cross(cylinder.axis.direction_world).norm();
  }
  return distances_m;
}

bool IsAlong(const Outline& outline, const Cylinder& cylinder, const PipeOptions& options) {
  return std::abs(cylinder.axis.direction_world.dot(outline.line.direction_world)) >=
         std::cos(options.max_turn_rad);
}

// Whether nearly all images of a pipe show an edge along nearly all of it that stays between its
// outlines.
bool HasRidge(const PipeCandidate& candidate, int images, const std::vector<Outline>& outlines,
              const PipeOptions& options) {
  constexpr double kMostAside = 0.5, kMostAway = 1.3, kLeastShare = 0.75;
  const Cylinder& cylinder = candidate.fit.cylinder;
  const double least_m = kLeastShare * (candidate.to_m - candidate.from_m);
  const auto is_ridge = [&](const Outline& line) {
    if (!IsAlong(line, cylinder, options) ||
        std::ranges::max(DistancesFromAxis_m(cylinder, line)) > kMostAway * cylinder.radius_m) {
      return false;
    }
    double beside_m = 0;
    for (const Interval& piece : PiecesAlong(cylinder.axis, line)) {
      beside_m += std::max(
          0.0, std::min(piece.to_m, candidate.to_m) - std::max(piece.from_m, candidate.from_m));
    }
    std::set<int> shown;
    for (const TangentRay& ray : line.rays) {
      const double aside_m = std::abs(SignedDistance(cylinder.axis, ray));
      if (aside_m < kMostAside * cylinder.radius_m) shown.insert(ray.image);
    }
    return beside_m >= least_m && static_cast<double>(shown.size()) >= kLeastShare * images;
  };
  const int segment = outlines[candidate.outlines.front()].segment;
  for (size_t i = 0; i < outlines.size(); ++i) {
    const bool is_its_own = std::ranges::find(candidate.outlines, i) != candidate.outlines.end();
    if (!is_its_own && outlines[i].segment == segment && is_ridge(outlines[i])) return true;
  }
  return false;
}

// What is known of a candidate.
struct Evidence {
  RayEvidence rays;
  SurfaceEvidence surface;
  WidthEvidence widths;
};

// By candidate, without the widths; nothing of those that hardly an image shows both sides of.
std::vector<std::optional<Evidence>> CollectEvidence(const std::vector<PipeCandidate>& candidates,
                                                     const std::vector<Outline>& outlines,
                                                     const MapResult& map,
                                                     const PipeOptions& options,
                                                     const Progress& progress) {
  const CloudAboutPipes cloud(map.dense);
  std::vector<std::optional<Evidence>> all(candidates.size());
  ForEachWatched(candidates.size(), progress, [&](size_t i) {
    const PipeCandidate& candidate = candidates[i];
    const Cylinder& cylinder = candidate.fit.cylinder;
    const RaysOfLines lines = CollectRays(candidate, outlines);
    Evidence evidence{CollectRayEvidence(cylinder, lines), {}, {}};
    if (!ShowsBothSides(evidence.rays)) return;
    // Thin ones are told by their widths alone.
    if (cylinder.radius_m >= std::min(kLeastRadiusOfCloud_m, options.min_outlined_radius_m)) {
      evidence.rays.has_ridge = HasRidge(candidate, evidence.rays.images, outlines, options);
      evidence.surface = cloud.Of(cylinder, candidate.from_m, candidate.to_m, lines);
    }
    all[i] = evidence;
  });
  return all;
}

// Adds how wide images show what may be a pipe.
void LookAtWidths(const std::vector<PipeCandidate>& candidates, const PipeImages& images,
                  const std::vector<Outline>& outlines, const PipeOptions& options,
                  const Progress& progress, std::vector<std::optional<Evidence>>* evidence) {
  std::vector<size_t> looked_at;
  std::vector<PipePlace> places;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const PipeCandidate& candidate = candidates[i];
    const Interval interval{candidate.from_m, candidate.to_m};
    if (!(*evidence)[i] || interval.length_m() < options.min_length_m ||
        IsFlat(candidate.fit.cylinder, (*evidence)[i]->surface)) {
      continue;
    }
    looked_at.push_back(i);
    places.push_back(
        {candidate.fit.cylinder, interval, outlines[candidate.outlines.front()].segment});
  }
  const auto widths = MeasureWidths(places, images, options.pose_sigma_m, progress);
  for (size_t k = 0; k < looked_at.size(); ++k) (*evidence)[looked_at[k]]->widths = widths[k];
}

// Those that are pipes by what images and cloud show, those of most weight first.
std::vector<JudgedPipe> Judge(const std::vector<PipeCandidate>& candidates,
                              const std::vector<std::optional<Evidence>>& all,
                              const PipeOptions& options) {
  std::vector<JudgedPipe> judged;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (!all[i]) continue;
    const auto& [rays, surface, widths] = *all[i];
    const Cylinder& cylinder = candidates[i].fit.cylinder;
    if (HasPipeWidth(cylinder, widths, surface)) {
      judged.push_back({&candidates[i], rays, 0});
    } else if (IsPipe(cylinder, rays, surface, options)) {
      judged.push_back({&candidates[i], rays, surface.off});
    }
  }
  std::ranges::stable_sort(judged, [](const JudgedPipe& a, const JudgedPipe& b) {
    if (a.Weight() != b.Weight()) return a.Weight() > b.Weight();
    return a.rays.round.squared < b.rays.round.squared;
  });
  return judged;
}

// Whether a line is an outline of a pipe that other views show: on its surface as far as it goes,
// and touched by the rays to it, which those to an edge of the wall behind do not.
bool IsFurtherOutline(const Outline& outline, const Cylinder& cylinder,
                      const PipeOptions& options) {
  constexpr double kSlack_m = 0.008, kShare = 0.08;
  if (!IsAlong(outline, cylinder, options)) return false;
  const double most_m = kSlack_m + kShare * cylinder.radius_m + kOutlineSigmas * outline.sigma_m;
  for (const double distance_m : DistancesFromAxis_m(cylinder, outline)) {
    if (std::abs(distance_m - cylinder.radius_m) > most_m) return false;
  }
  return TouchingShare(cylinder, outline, options) >= options.min_touching;
}

bool IsBeside(const std::vector<Interval>& pieces, const std::vector<Interval>& intervals) {
  return std::ranges::any_of(pieces, [&](const Interval& piece) {
    return std::ranges::any_of(intervals, [&](const Interval& interval) {
      return piece.from_m <= interval.to_m + kMaxGap_m && piece.to_m >= interval.from_m - kMaxGap_m;
    });
  });
}

// Where a pipe is, along its axis, and the lines that say so.
struct PipeExtent {
  std::vector<Interval> intervals;
  std::vector<size_t> outlines;
};

// The outlines of a candidate, but for short gaps, where they are long enough; and what else of
// them, and of further outlines that no other pipe has, begins there and goes on.
PipeExtent MeasureExtent(const PipeCandidate& candidate, const std::vector<Outline>& outlines,
                         const std::vector<char>& explained, const PipeOptions& options) {
  const Cylinder& cylinder = candidate.fit.cylinder;
  const int segment = outlines[candidate.outlines.front()].segment;
  PipeExtent extent{{}, candidate.outlines};
  std::vector<std::pair<size_t, std::vector<Interval>>> others;
  for (const size_t i : candidate.outlines) {
    for (const Interval& piece : PiecesAlong(cylinder.axis, outlines[i])) {
      extent.intervals.push_back(piece);
      others.push_back({i, {piece}});
    }
  }
  extent.intervals = Union(std::move(extent.intervals), kMaxGap_m);
  std::erase_if(extent.intervals,
                [&](const Interval& own) { return own.length_m() < options.min_length_m; });
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (!explained[i] && outlines[i].segment == segment &&
        IsFurtherOutline(outlines[i], cylinder, options)) {
      others.push_back({i, PiecesAlong(cylinder.axis, outlines[i])});
    }
  }
  for (bool goes_on = true; goes_on;) {
    goes_on =
        std::erase_if(others, [&](const auto& other) {
          if (!IsBeside(other.second, extent.intervals)) return false;
          extent.intervals.insert(extent.intervals.end(), other.second.begin(), other.second.end());
          extent.outlines.push_back(other.first);
          return true;
        }) > 0;
    extent.intervals = Union(std::move(extent.intervals), kMaxGap_m);
  }
  return extent;
}

// The outline that says most of which axis of the building a pipe follows.
const Outline& FindLongest(const PipeCandidate& candidate, const std::vector<Outline>& outlines) {
  return outlines[*std::ranges::max_element(candidate.outlines, {},
                                            [&](size_t i) { return outlines[i].half_m; })];
}

void AddMapPipes(const JudgedPipe& judged, const std::vector<Interval>& intervals,
                 const std::vector<Outline>& outlines, double min_length_m,
                 std::vector<MapPipe>* pipes) {
  const PipeFit& fit = judged.candidate->fit;
  const Outline& longest = FindLongest(*judged.candidate, outlines);
  MapPipe pipe;
  pipe.segment = longest.segment;
  pipe.axis = longest.axis;
  pipe.world = longest.world;
  pipe.radius_m = fit.cylinder.radius_m;
  pipe.sigma_m = fit.sigma_m();
  pipe.radius_sigma_m = fit.radius_sigma_m();
  pipe.images = judged.rays.images;
  const PointAndDirection& axis = fit.cylinder.axis;
  for (const Interval& interval : intervals) {
    if (interval.length_m() < min_length_m) continue;
    pipe.id = static_cast<int64_t>(pipes->size());
    pipe.start_world = axis.point_world + interval.from_m * axis.direction_world;
    pipe.end_world = axis.point_world + interval.to_m * axis.direction_world;
    pipes->push_back(pipe);
  }
}

// Whether a line lies on a pipe, along it: a seam, a glint, or an outline that few images show.
bool IsOnPipe(const Outline& outline, const Cylinder& cylinder,
              const std::vector<Interval>& intervals, const PipeOptions& options) {
  constexpr double kSlack_m = 0.005, kBeyond_m = 0.1;
  if (!IsAlong(outline, cylinder, options)) return false;
  const double most_m = cylinder.radius_m + kSlack_m + kOutlineSigmas * outline.sigma_m;
  if (std::ranges::max(DistancesFromAxis_m(cylinder, outline)) > most_m) return false;
  const auto is_on = [&](double along_m) {
    const Vector3d p = outline.line.point_world + along_m * outline.line.direction_world;
    const double at_m = cylinder.axis.direction_world.dot(p - cylinder.axis.point_world);
    return std::ranges::any_of(intervals, [&](const Interval& interval) {
      return at_m >= interval.from_m - kBeyond_m && at_m <= interval.to_m + kBeyond_m;
    });
  };
  return is_on(-outline.half_m) && is_on(0) && is_on(outline.half_m);
}

// The pieces of lines that stay have the numbers that they had, as lines leave whole.
template <typename Items, typename ComputeId>
void Leave(const std::vector<int64_t>& ids, ComputeId id_of, Items* items) {
  std::erase_if(*items,
                [&](const auto& item) { return std::ranges::binary_search(ids, item.*id_of); });
}

}  // namespace

FoundPipes FindPipes(const MapResult& map, const PipeOptions& options, const PipeImages* images,
                     const Progress& progress) {
  constexpr double kCandidates = 0.25, kEvidence = 0.5;  // of the time
  const std::vector<Outline> outlines = CollectOutlines(map, options);
  const std::vector<PipeCandidate> candidates =
      PipeCandidates(outlines, options, progress.Part(0, kCandidates));
  std::vector<std::optional<Evidence>> evidence =
      CollectEvidence(candidates, outlines, map, options, progress.Part(kCandidates, kEvidence));
  if (images != nullptr) {
    LookAtWidths(candidates, *images, outlines, options, progress.Part(kEvidence, 1), &evidence);
  }
  if (!progress.Report(1)) return {};
  std::vector<char> explained(outlines.size(), 0);
  FoundPipes found;
  for (const JudgedPipe& judged : Judge(candidates, evidence, options)) {
    const PipeCandidate& candidate = *judged.candidate;
    const auto is_explained = [&](size_t i) { return explained[i] != 0; };
    if (std::ranges::any_of(candidate.outlines, is_explained)) continue;
    const PipeExtent extent = MeasureExtent(candidate, outlines, explained, options);
    const size_t before = found.pipes.size();
    AddMapPipes(judged, extent.intervals, outlines, options.min_length_m, &found.pipes);
    if (found.pipes.size() == before) continue;
    const int segment = outlines[candidate.outlines.front()].segment;
    for (const size_t i : extent.outlines) explained[i] = 1;
    for (size_t i = 0; i < outlines.size(); ++i) {
      explained[i] |= outlines[i].segment == segment &&
                      IsOnPipe(outlines[i], candidate.fit.cylinder, extent.intervals, options);
    }
  }
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (explained[i]) found.line_ids.push_back(outlines[i].line_id);
  }
  std::ranges::sort(found.line_ids);
  return found;
}

void AddPipes(const PipeOptions& options, const PipeImages* images, const Progress& progress,
              MapResult* map) {
  if (!options.find) return;
  FoundPipes found = FindPipes(*map, options, images, progress);
  map->pipes = std::move(found.pipes);
  Leave(found.line_ids, &MapLine::id, &map->lines);
  Leave(found.line_ids, &MapLine::id, &map->marks);
  Leave(found.line_ids, &LineCovariance::line_id, &map->line_evidence.covariances);
  Leave(found.line_ids, &LineSupport::line_id, &map->line_evidence.supports);
}

}  // namespace slcmap::mapping
