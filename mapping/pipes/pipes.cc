#include "mapping/pipes/pipes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/core/parallel.h"
#include "data/io/yaml.h"
#include "mapping/lines/line_merging.h"
#include "mapping/pipes/outlines.h"
#include "mapping/pipes/pipe_likelihood.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kMostTurn_rad = 0.05;    // between lines that are outlines of one pipe
constexpr double kLeastOverlap_m = 0.25;  // of two of them
constexpr double kLeastTouching = 0.75;   // share of the sights of an outline
constexpr double kMaxGap_m = 0.5;         // in a pipe
constexpr double kSlack_m = 0.008, kOutlineSigmas = 2;  // of lines on a pipe
// Of a pipe against what is none, before anything of the two lines is known: of all pairs of
// parallel lines few are of a pipe.
constexpr double kPriorLogRatio = -5;

// What some outlines may be of.
struct Candidate {
  PipeFit fit;
  std::vector<size_t> outlines;
  std::vector<Interval> intervals;  // along the axis, from its point
  double log_ratio = 0;

  // Some of a pipe's outlines, or with those of another, may make a pipe that is askew: of those
  // that share lines the one that is seen most.
  double Weight() const { return log_ratio * fit.both_images; }
};

bool IsAlong(const Outline& outline, const PointAndDirection& axis) {
  return std::abs(axis.direction_world.dot(outline.line.direction_world)) >=
         std::cos(kMostTurn_rad);
}

// How far from the axis a line is at its ends and in the middle.
std::array<double, 3> DistancesFromAxis_m(const PointAndDirection& axis, const Outline& outline) {
  std::array<double, 3> distances_m;
  for (int i = 0; i < 3; ++i) {
    const Vector3d p =
        outline.line.point_world + (i - 1) * outline.half_m * outline.line.direction_world;
    distances_m[i] = (p - axis.point_world).cross(axis.direction_world).norm();
  }
  return distances_m;
}

// The pieces of an outline, along an axis.
std::vector<Interval> PiecesAlong(const PointAndDirection& axis, const Outline& outline) {
  const double sense = outline.line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const double middle_m = axis.direction_world.dot(outline.line.point_world - axis.point_world);
  std::vector<Interval> pieces;
  for (const Interval& piece : outline.pieces) {
    const double a_m = middle_m + sense * piece.from_m, b_m = middle_m + sense * piece.to_m;
    pieces.push_back({std::min(a_m, b_m), std::max(a_m, b_m)});
  }
  return pieces;
}

bool IsBeside(const std::vector<Interval>& pieces, const std::vector<Interval>& intervals) {
  return std::ranges::any_of(pieces, [&](const Interval& piece) {
    return std::ranges::any_of(intervals, [&](const Interval& interval) {
      return piece.from_m <= interval.to_m + kMaxGap_m && piece.to_m >= interval.from_m - kMaxGap_m;
    });
  });
}

// Whether a line may be on the surface of a pipe: an outline that some views show, a seam, a glint.
bool IsOnSurface(const Outline& outline, const Cylinder& cylinder) {
  return IsAlong(outline, cylinder.axis) &&
         std::ranges::max(DistancesFromAxis_m(cylinder.axis, outline)) <=
             cylinder.radius_m + kSlack_m + kOutlineSigmas * outline.sigma_m;
}

// The middle between two lines where they are side by side, with their direction; nothing where
// they are not parallel, or nowhere side by side.
std::optional<PointAndDirection> Between(const Outline& a, const Outline& b) {
  if (!IsAlong(a, b.line) || a.segment != b.segment) return std::nullopt;
  const double sense = a.line.direction_world.dot(b.line.direction_world) < 0 ? -1 : 1;
  const Vector3d direction =
      (a.half_m * a.line.direction_world + sense * b.half_m * b.line.direction_world).normalized();
  const double along_m = direction.dot(b.line.point_world - a.line.point_world);
  const double from_m = std::max(-a.half_m, along_m - b.half_m);
  const double to_m = std::min(a.half_m, along_m + b.half_m);
  if (to_m - from_m < kLeastOverlap_m) return std::nullopt;
  const double middle_m = 0.5 * (from_m + to_m);
  const Vector3d on_a = a.line.point_world + middle_m * a.line.direction_world;
  const Vector3d on_b = b.line.point_world + (middle_m - along_m) * sense * b.line.direction_world;
  return PointAndDirection{0.5 * (on_a + on_b), direction};
}

class PipeFinder {
 public:
  PipeFinder(const std::vector<Outline>& outlines, const IndexedCloud& cloud,
             const PipeOptions& options)
      : outlines_(outlines), cloud_(cloud), options_(options) {}

  // What two lines may be outlines of, with the others that touch it; nothing where something else
  // is likelier.
  std::optional<Candidate> Try(size_t a, size_t b) const {
    const auto middle = Between(outlines_[a], outlines_[b]);
    if (!middle) return std::nullopt;
    const double apart_m = 2 * DistancesFromAxis_m(*middle, outlines_[a])[1];
    if (apart_m < options_.min_radius_m || apart_m > 2.2 * options_.max_radius_m) {
      return std::nullopt;
    }
    std::optional<Candidate> candidate = Fit(*middle, {a, b});
    if (!candidate) return std::nullopt;
    std::vector<size_t> all = candidate->outlines;
    for (size_t i = 0; i < outlines_.size(); ++i) {
      if (i != a && i != b && IsFurther(outlines_[i], *candidate)) all.push_back(i);
    }
    if (all.size() > 2) {
      if (auto grown = Fit(candidate->fit.cylinder.axis, all)) candidate = std::move(grown);
    }
    const Interval whole{candidate->intervals.front().from_m, candidate->intervals.back().to_m};
    candidate->log_ratio =
        kPriorLogRatio +
        ComputePipeLogRatio(candidate->fit.cylinder, whole, Collect(candidate->outlines), cloud_);
    if (!(candidate->log_ratio > 0)) return std::nullopt;  // also where nothing was measured
    return candidate;
  }

  // Follows a pipe along lines on its surface that no other has. The lines that it explains.
  std::vector<size_t> Follow(const std::vector<char>& explained, Candidate* pipe) const {
    std::vector<size_t> left, taken = pipe->outlines;
    for (size_t i = 0; i < outlines_.size(); ++i) {
      if (!explained[i] && outlines_[i].segment == outlines_[taken.front()].segment &&
          IsOnSurface(outlines_[i], pipe->fit.cylinder)) {
        left.push_back(i);
      }
    }
    const PointAndDirection& axis = pipe->fit.cylinder.axis;
    for (bool goes_on = true; goes_on;) {
      goes_on = std::erase_if(left, [&](size_t i) {
                  const std::vector<Interval> pieces = PiecesAlong(axis, outlines_[i]);
                  if (!IsBeside(pieces, pipe->intervals)) return false;
                  taken.push_back(i);
                  if (TouchingShare(pipe->fit.cylinder, outlines_[i]) < kLeastTouching) return true;
                  pipe->intervals.insert(pipe->intervals.end(), pieces.begin(), pieces.end());
                  return true;
                }) > 0;
      pipe->intervals = Union(std::move(pipe->intervals), kMaxGap_m);
    }
    return taken;
  }

 private:
  std::vector<const Outline*> Collect(const std::vector<size_t>& some) const {
    std::vector<const Outline*> outlines;
    for (const size_t i : some) outlines.push_back(&outlines_[i]);
    return outlines;
  }

  std::optional<Candidate> Fit(const PointAndDirection& axis,
                               const std::vector<size_t>& outlines) const {
    const auto fit = FitPipe(axis, Collect(outlines));
    if (!fit || fit->cylinder.radius_m < options_.min_radius_m ||
        fit->cylinder.radius_m > options_.max_radius_m) {
      return std::nullopt;
    }
    Candidate candidate{*fit, outlines, {}, 0};
    for (const size_t i : outlines) {
      if (TouchingShare(fit->cylinder, outlines_[i]) < kLeastTouching) return std::nullopt;
      for (const Interval& piece : PiecesAlong(fit->cylinder.axis, outlines_[i])) {
        candidate.intervals.push_back(piece);
      }
    }
    candidate.intervals = Union(std::move(candidate.intervals), kMaxGap_m);
    const auto is_long = [&](const Interval& own) {
      return own.length_m() >= options_.min_length_m;
    };
    if (std::ranges::none_of(candidate.intervals, is_long)) return std::nullopt;
    return candidate;
  }

  // A line that views on both sides of it have for one is somewhat outside.
  bool IsFurther(const Outline& outline, const Candidate& candidate) const {
    const Cylinder& cylinder = candidate.fit.cylinder;
    if (!IsAlong(outline, cylinder.axis) ||
        outline.segment != outlines_[candidate.outlines.front()].segment) {
      return false;
    }
    const double off_m =
        std::abs(DistancesFromAxis_m(cylinder.axis, outline)[1] - cylinder.radius_m);
    return off_m <= 0.5 * cylinder.radius_m + kSlack_m + kOutlineSigmas * outline.sigma_m &&
           IsBeside(PiecesAlong(cylinder.axis, outline), candidate.intervals) &&
           TouchingShare(cylinder, outline) >= kLeastTouching;
  }

  const std::vector<Outline>& outlines_;
  const IndexedCloud& cloud_;
  const PipeOptions& options_;
};

// Of all pairs of lines, those of most weight first; none once progress says so.
std::vector<Candidate> CollectCandidates(const PipeFinder& finder, size_t outlines,
                                         const Progress& progress) {
  std::vector<std::vector<Candidate>> found(outlines);
  if (!ForEachWatched(outlines, progress, [&](size_t a) {
        for (size_t b = a + 1; b < outlines; ++b) {
          if (auto candidate = finder.Try(a, b)) found[a].push_back(std::move(*candidate));
        }
      })) {
    return {};
  }
  std::vector<Candidate> candidates;
  for (auto& of_first : found) std::ranges::move(of_first, std::back_inserter(candidates));
  std::ranges::stable_sort(candidates, std::greater(), &Candidate::Weight);
  return candidates;
}

void AddMapPipes(const Candidate& candidate, const std::vector<Outline>& outlines,
                 double min_length_m, std::vector<MapPipe>* pipes) {
  // The outline that says most of which axis of the building it follows.
  const Outline& longest = outlines[*std::ranges::max_element(
      candidate.outlines, {}, [&](size_t i) { return outlines[i].half_m; })];
  const PointAndDirection& axis = candidate.fit.cylinder.axis;
  for (const Interval& interval : candidate.intervals) {
    if (interval.length_m() < min_length_m) continue;
    pipes->push_back({std::ssize(*pipes), longest.segment, longest.axis, longest.world,
                      axis.point_world + interval.from_m * axis.direction_world,
                      axis.point_world + interval.to_m * axis.direction_world,
                      candidate.fit.cylinder.radius_m, candidate.fit.sigma_m(),
                      candidate.fit.radius_sigma_m(), candidate.fit.images});
  }
}

// The pieces of lines that stay have the numbers that they had, as lines leave whole.
template <typename Items, typename ComputeId>
void Leave(const std::vector<int64_t>& ids, ComputeId id_of, Items* items) {
  std::erase_if(*items,
                [&](const auto& item) { return std::ranges::binary_search(ids, item.*id_of); });
}

constexpr OptionTable kTable{Option{"find", &PipeOptions::find, false, true},
                             Option{"min_radius_m", &PipeOptions::min_radius_m, 0.005, 10.0},
                             Option{"max_radius_m", &PipeOptions::max_radius_m, 0.005, 10.0},
                             Option{"min_length_m", &PipeOptions::min_length_m, 0.1, 100.0}};

}  // namespace

void PipeOptions::Check() const {
  kTable.Check("mapping.pipes", *this);
  if (max_radius_m < min_radius_m) {
    throw ConfigError("mapping.pipes.max_radius_m: expected at least min_radius_m");
  }
}

void PipeOptions::Read(YamlSection section) { kTable.Read(section, this); }

FoundPipes FindPipes(const MapResult& map, const PipeOptions& options, const Progress& progress) {
  const std::vector<Outline> outlines = CollectOutlines(map);
  const PointTree index(map.dense);
  const IndexedCloud cloud{map.dense, index};
  const PipeFinder finder(outlines, cloud, options);
  std::vector<char> explained(outlines.size(), 0);
  FoundPipes found;
  for (Candidate& pipe : CollectCandidates(finder, outlines.size(), progress)) {
    const auto is_explained = [&](size_t i) { return explained[i] != 0; };
    if (std::ranges::any_of(pipe.outlines, is_explained)) continue;
    const std::vector<size_t> taken = finder.Follow(explained, &pipe);
    AddMapPipes(pipe, outlines, options.min_length_m, &found.pipes);
    for (const size_t i : taken) explained[i] = 1;
  }
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (explained[i]) found.line_ids.push_back(outlines[i].line_id);
  }
  std::ranges::sort(found.line_ids);
  return found;
}

void AddPipes(const PipeOptions& options, const Progress& progress, MapResult* map) {
  if (!options.find) return;
  FoundPipes found = FindPipes(*map, options, progress);
  map->pipes = std::move(found.pipes);
  Leave(found.line_ids, &MapLine::id, &map->lines);
  Leave(found.line_ids, &MapLine::id, &map->marks);
  Leave(found.line_ids, &LineCovariance::line_id, &map->line_evidence.covariances);
  Leave(found.line_ids, &LineSupport::line_id, &map->line_evidence.supports);
}

}  // namespace slcmap::mapping
