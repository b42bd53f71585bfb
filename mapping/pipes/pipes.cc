#include "mapping/pipes/pipes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kMaxGap_m = 0.5;  // in a pipe
// Of the images of any pipe, those that show outlines on both sides.
constexpr double kLeastBoth = 0.2;

struct JudgedPipe {
  const PipeCandidate* candidate = nullptr;
  RayEvidence rays;
  double surface_off = 0;  // in radii

  // Some of a pipe's outlines, or with those of another, may make a pipe that is askew: of those
  // that share lines the one that is seen most, and as round as the cloud is.
  double Weight() const { return rays.both_images * (1 - std::min(1.0, surface_off)); }
};

// The images tell it from an edge on each side.
bool IsTold(const RayEvidence& rays, const PipeOptions& options) {
  constexpr double kLeastTold = 0.08, kLeastSquared = 15, kLeastShare = 0.5;
  const bool by_most = rays.straight.median >= options.min_gain * rays.round.median &&
                       rays.told.median >= kLeastTold;
  const double gain = rays.straight.squared - rays.round.squared;
  return by_most || (rays.told.squared >= kLeastSquared && gain >= kLeastShare * rays.told.squared);
}

// Neither an edge on each side nor one for each line does better.
bool FitsAsWell(const RayEvidence& rays) {
  constexpr double kSlack = 1.3, kFew = 3, kMostOfOutline = 1;
  return rays.round.squared <= kSlack * rays.straight.squared + kFew &&
         rays.round.median <= kSlack * rays.own.median &&
         rays.round.squared <= kMostOfOutline * rays.outlines;
}

// The cloud does not bulge between the outlines, or it goes on beside them, as about a trim or the
// frame of a door.
bool IsContradicted(const Cylinder& cylinder, const SurfaceEvidence& surface,
                    const PipeOptions& options) {
  constexpr int kLeastPoints = 30;
  constexpr double kLeastHighest = 0.6, kMostOff = 0.7, kBeside = 0.25, kClearlyRound = 0.3;
  return surface.points < kLeastPoints || surface.highest < kLeastHighest ||
         surface.off > kMostOff || surface.off * cylinder.radius_m > options.max_outlined_off_m ||
         (surface.beside > kBeside && surface.off > kClearlyRound);
}

// The outlines fit edges as well, but the cloud bulges between them, and is behind beside them.
bool StandsOut(const RayEvidence& rays, const SurfaceEvidence& surface) {
  constexpr double kMostMedian = 0.2, kSlack = 1.3, kFew = 3;
  constexpr int kLeastPoints = 60;
  constexpr double kMostOff = 0.55, kLeastHighest = 0.7, kMostHighest = 1.1, kBehind = -0.3;
  return rays.round.median <= kMostMedian &&
         rays.round.squared <= kSlack * rays.straight.squared + kFew &&
         surface.points >= kLeastPoints && surface.off <= kMostOff &&
         surface.highest >= kLeastHighest && surface.highest <= kMostHighest &&
         surface.beside <= kBehind;
}

// Where the views should tell it from edges, and edges do better nevertheless.
bool SpeaksForEdges(const RayEvidence& rays) {
  constexpr double kTold = 15, kLeastShare = 0.3;
  return rays.told.squared >= kTold &&
         rays.straight.squared - rays.round.squared < kLeastShare * rays.told.squared;
}

// The cloud bulges between the outlines nearly as a pipe does, and is behind beside them; from one
// side the outlines need not say more than that a pipe fits about as well as edges do.
bool Bulges(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 30, kLeastPoints = 80;
  constexpr double kLeastBoth = 0.7, kSlack = 1.3, kFew = 3, kMostOfOwn = 2.5;
  constexpr double kLeastLength_m = 1.5, kLeastRadius_m = 0.05;
  constexpr double kLeastHeight = 0.3, kLeastHighest = 0.55, kMostHighest = 1.2, kMostOff = 0.52;
  constexpr double kBehind = -0.5;
  return cylinder.radius_m >= kLeastRadius_m && surface.length_m >= kLeastLength_m &&
         rays.images >= kLeastImages && rays.both_images >= kLeastBoth * rays.images &&
         rays.round.squared <= kSlack * rays.straight.squared + kFew &&
         rays.round.squared <= kMostOfOwn * rays.own.squared + kFew &&
         surface.points >= kLeastPoints && surface.height >= kLeastHeight &&
         surface.highest >= kLeastHighest && surface.highest <= kMostHighest &&
         surface.off <= kMostOff && surface.beside <= kBehind && !SpeaksForEdges(rays);
}

// A long bar that nearly all images show both outlines of, and that all that is known beside it is
// behind. What of the cloud is on it bulges, though much of it is torn to what is behind: so may a
// flat strip, or a square bar seen from one side alone, but these seldom stand as free.
bool StandsFree(const RayEvidence& rays, const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 60, kLeastPoints = 150;
  constexpr double kLeastBoth = 0.85, kSlack = 1.3, kFew = 3;
  constexpr double kLeastHeight = 0.15, kLeastHighest = 0.45, kMostHighest = 1.1, kBehind = -1;
  return rays.images >= kLeastImages && rays.both_images >= kLeastBoth * rays.images &&
         rays.round.squared <= kSlack * rays.straight.squared + kFew &&
         surface.points >= kLeastPoints && surface.height >= kLeastHeight &&
         surface.highest >= kLeastHighest && surface.highest <= kMostHighest &&
         surface.beside <= kBehind;
}

// The cloud alone tells it, which is too coarse for thin ones. A long pipe has many lines in each
// image, and these may be as far off it as they are off themselves.
bool HasRoundSurface(const Cylinder& cylinder, const RayEvidence& rays,
                     const SurfaceEvidence& surface, const PipeOptions& options) {
  constexpr int kLeastPoints = 60;
  constexpr double kLeastRadius_m = 0.08;
  constexpr double kLeastHeight = 0.8, kMostMedian = 0.75, kMostOfImage = 3, kMostOfOwn = 2;
  return cylinder.radius_m >= kLeastRadius_m && surface.points >= kLeastPoints &&
         rays.both_images >= kLeastBoth * rays.images && surface.height >= kLeastHeight &&
         surface.off <= options.max_surface_off && rays.round.median <= kMostMedian &&
         rays.round.squared <= std::max(kMostOfImage * rays.images, kMostOfOwn * rays.own.squared);
}

RaysOfLines RaysOf(const PipeCandidate& candidate, const std::vector<Outline>& outlines) {
  RaysOfLines rays;
  for (const size_t i : candidate.outlines) rays.push_back(&outlines[i].rays);
  return rays;
}

// The pieces of an outline, along the axis of a pipe.
std::vector<Stretch> PiecesAlong(const PointAndDirection& axis, const Outline& outline) {
  const PointAndDirection& line = outline.line;
  const double sense = line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
  const double middle_m = axis.direction_world.dot(line.point_world - axis.point_world);
  std::vector<Stretch> pieces;
  for (const Stretch& piece : outline.pieces) {
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
    for (const Stretch& piece : PiecesAlong(cylinder.axis, line)) {
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

// Those that are pipes by what images and cloud show, those of most weight first.
std::vector<JudgedPipe> Judge(const std::vector<PipeCandidate>& candidates,
                              const std::vector<Outline>& outlines, const MapResult& map,
                              const PipeOptions& options) {
  const CloudAboutPipes cloud(map.dense);
  std::vector<std::optional<JudgedPipe>> all(candidates.size());
  cv::parallel_for_({0, static_cast<int>(candidates.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const PipeCandidate& candidate = candidates[i];
      const Cylinder& cylinder = candidate.fit.cylinder;
      const RaysOfLines lines = RaysOf(candidate, outlines);
      RayEvidence rays = RayEvidenceOf(cylinder, lines);
      if (rays.both_images < kLeastBoth * rays.images) continue;
      rays.has_ridge = HasRidge(candidate, rays.images, outlines, options);
      const SurfaceEvidence surface = cloud.Of(cylinder, candidate.from_m, candidate.to_m, lines);
      if (IsPipe(cylinder, rays, surface, options)) {
        all[i] = JudgedPipe{&candidate, rays, surface.off};
      }
    }
  });
  std::vector<JudgedPipe> judged;
  for (const std::optional<JudgedPipe>& pipe : all) {
    if (pipe) judged.push_back(*pipe);
  }
  std::ranges::stable_sort(judged, [](const JudgedPipe& a, const JudgedPipe& b) {
    if (a.Weight() != b.Weight()) return a.Weight() > b.Weight();
    return a.rays.round.squared < b.rays.round.squared;
  });
  return judged;
}

// Sorted, and one where they are next to each other but for short gaps.
std::vector<Stretch> Joined(std::vector<Stretch> pieces) {
  std::ranges::sort(pieces, {}, &Stretch::from_m);
  std::vector<Stretch> stretches;
  for (const Stretch& piece : pieces) {
    if (!stretches.empty() && piece.from_m <= stretches.back().to_m + kMaxGap_m) {
      stretches.back().to_m = std::max(stretches.back().to_m, piece.to_m);
    } else {
      stretches.push_back(piece);
    }
  }
  return stretches;
}

// Whether a line is an outline of a pipe that other views show: on its surface as far as it goes,
// and touched by the rays to it, which those to an edge of the wall behind do not.
bool IsFurtherOutline(const Outline& outline, const Cylinder& cylinder,
                      const PipeOptions& options) {
  constexpr double kSlack_m = 0.008, kShare = 0.08, kSigmas = 2;
  if (!IsAlong(outline, cylinder, options)) return false;
  const double most_m = kSlack_m + kShare * cylinder.radius_m + kSigmas * outline.sigma_m;
  for (const double distance_m : DistancesFromAxis_m(cylinder, outline)) {
    if (std::abs(distance_m - cylinder.radius_m) > most_m) return false;
  }
  return TouchingShare(cylinder, outline, options) >= options.min_touching;
}

bool IsBeside(const std::vector<Stretch>& pieces, const std::vector<Stretch>& stretches) {
  return std::ranges::any_of(pieces, [&](const Stretch& piece) {
    return std::ranges::any_of(stretches, [&](const Stretch& stretch) {
      return piece.from_m <= stretch.to_m + kMaxGap_m && piece.to_m >= stretch.from_m - kMaxGap_m;
    });
  });
}

// Where a pipe is, along its axis, and the lines that say so.
struct PipeExtent {
  std::vector<Stretch> stretches;
  std::vector<size_t> outlines;
};

// The outlines of a candidate, but for short gaps, where they are long enough; and what else of
// them, and of further outlines that no other pipe has, begins there and goes on.
PipeExtent ExtentOf(const PipeCandidate& candidate, const std::vector<Outline>& outlines,
                    const std::vector<char>& explained, const PipeOptions& options) {
  const Cylinder& cylinder = candidate.fit.cylinder;
  const int segment = outlines[candidate.outlines.front()].segment;
  PipeExtent extent{{}, candidate.outlines};
  std::vector<std::pair<size_t, std::vector<Stretch>>> others;
  for (const size_t i : candidate.outlines) {
    for (const Stretch& piece : PiecesAlong(cylinder.axis, outlines[i])) {
      extent.stretches.push_back(piece);
      others.push_back({i, {piece}});
    }
  }
  extent.stretches = Joined(std::move(extent.stretches));
  std::erase_if(extent.stretches,
                [&](const Stretch& own) { return own.length_m() < options.min_length_m; });
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (!explained[i] && outlines[i].segment == segment &&
        IsFurtherOutline(outlines[i], cylinder, options)) {
      others.push_back({i, PiecesAlong(cylinder.axis, outlines[i])});
    }
  }
  for (bool goes_on = true; goes_on;) {
    goes_on =
        std::erase_if(others, [&](const auto& other) {
          if (!IsBeside(other.second, extent.stretches)) return false;
          extent.stretches.insert(extent.stretches.end(), other.second.begin(), other.second.end());
          extent.outlines.push_back(other.first);
          return true;
        }) > 0;
    extent.stretches = Joined(std::move(extent.stretches));
  }
  return extent;
}

// The outline that says most of which axis of the building a pipe follows.
const Outline& LongestOf(const PipeCandidate& candidate, const std::vector<Outline>& outlines) {
  return outlines[*std::ranges::max_element(candidate.outlines, {},
                                            [&](size_t i) { return outlines[i].half_m; })];
}

void AddMapPipes(const JudgedPipe& judged, const std::vector<Stretch>& stretches,
                 const std::vector<Outline>& outlines, double min_length_m,
                 std::vector<MapPipe>* pipes) {
  const PipeFit& fit = judged.candidate->fit;
  const Outline& longest = LongestOf(*judged.candidate, outlines);
  MapPipe pipe;
  pipe.segment = longest.segment;
  pipe.axis = longest.axis;
  pipe.world = longest.world;
  pipe.radius_m = fit.cylinder.radius_m;
  pipe.sigma_m = fit.sigma_m();
  pipe.radius_sigma_m = fit.radius_sigma_m();
  pipe.images = judged.rays.images;
  const PointAndDirection& axis = fit.cylinder.axis;
  for (const Stretch& stretch : stretches) {
    if (stretch.length_m() < min_length_m) continue;
    pipe.id = static_cast<int64_t>(pipes->size());
    pipe.start_world = axis.point_world + stretch.from_m * axis.direction_world;
    pipe.end_world = axis.point_world + stretch.to_m * axis.direction_world;
    pipes->push_back(pipe);
  }
}

// Whether a line lies on a pipe, along it: a seam, a glint, or an outline that few images show.
bool IsOnPipe(const Outline& outline, const Cylinder& cylinder,
              const std::vector<Stretch>& stretches, const PipeOptions& options) {
  constexpr double kSlack_m = 0.005, kBeyond_m = 0.1, kSigmas = 2;
  if (!IsAlong(outline, cylinder, options)) return false;
  const double most_m = cylinder.radius_m + kSlack_m + kSigmas * outline.sigma_m;
  if (std::ranges::max(DistancesFromAxis_m(cylinder, outline)) > most_m) return false;
  const auto is_on = [&](double along_m) {
    const Vector3d p = outline.line.point_world + along_m * outline.line.direction_world;
    const double at_m = cylinder.axis.direction_world.dot(p - cylinder.axis.point_world);
    return std::ranges::any_of(stretches, [&](const Stretch& stretch) {
      return at_m >= stretch.from_m - kBeyond_m && at_m <= stretch.to_m + kBeyond_m;
    });
  };
  return is_on(-outline.half_m) && is_on(0) && is_on(outline.half_m);
}

// The pieces of lines that stay have the numbers that they had, as lines leave whole.
template <typename Items, typename IdOf>
void Leave(const std::vector<int64_t>& ids, IdOf id_of, Items* items) {
  std::erase_if(*items,
                [&](const auto& item) { return std::ranges::binary_search(ids, item.*id_of); });
}

}  // namespace

bool IsPipe(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface,
            const PipeOptions& options) {
  if (HasRoundSurface(cylinder, rays, surface, options)) return true;
  if (rays.both_images < options.min_both_sides * rays.images) return false;
  const bool outlined =
      IsTold(rays, options) && FitsAsWell(rays) && !IsContradicted(cylinder, surface, options);
  if (outlined) return true;
  return !rays.has_ridge &&
         (StandsOut(rays, surface) || Bulges(cylinder, rays, surface) || StandsFree(rays, surface));
}

FoundPipes FindPipes(const MapResult& map, const PipeOptions& options) {
  const std::vector<Outline> outlines = OutlinesOf(map, options);
  const std::vector<PipeCandidate> candidates = PipeCandidates(outlines, options);
  std::vector<char> explained(outlines.size(), 0);
  FoundPipes found;
  for (const JudgedPipe& judged : Judge(candidates, outlines, map, options)) {
    const PipeCandidate& candidate = *judged.candidate;
    const auto is_explained = [&](size_t i) { return explained[i] != 0; };
    if (std::ranges::any_of(candidate.outlines, is_explained)) continue;
    const PipeExtent extent = ExtentOf(candidate, outlines, explained, options);
    const size_t before = found.pipes.size();
    AddMapPipes(judged, extent.stretches, outlines, options.min_length_m, &found.pipes);
    if (found.pipes.size() == before) continue;
    const int segment = outlines[candidate.outlines.front()].segment;
    for (const size_t i : extent.outlines) explained[i] = 1;
    for (size_t i = 0; i < outlines.size(); ++i) {
      explained[i] |= outlines[i].segment == segment &&
                      IsOnPipe(outlines[i], candidate.fit.cylinder, extent.stretches, options);
    }
  }
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (explained[i]) found.line_ids.push_back(outlines[i].line_id);
  }
  std::ranges::sort(found.line_ids);
  return found;
}

void AddPipes(const PipeOptions& options, MapResult* map) {
  if (!options.find) return;
  FoundPipes found = FindPipes(*map, options);
  map->pipes = std::move(found.pipes);
  Leave(found.line_ids, &MapLine::id, &map->lines);
  Leave(found.line_ids, &MapLine::id, &map->marks);
  Leave(found.line_ids, &LineCovariance::line_id, &map->line_evidence.covariances);
  Leave(found.line_ids, &LineSupport::line_id, &map->line_evidence.supports);
}

}  // namespace slcmap
