#include "mapping/pipes/pipes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kMaxGap_m = 0.5;  // in a pipe

struct JudgedPipe {
  const PipeCandidate* candidate = nullptr;
  RayEvidence rays;
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
  constexpr double kSlack = 1.3, kFew = 3, kMostOfImage = 2;
  return rays.round.squared <= kSlack * rays.straight.squared + kFew &&
         rays.round.median <= kSlack * rays.own.median &&
         rays.round.squared <= kMostOfImage * rays.images;
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
         surface.height >= kLeastHeight && surface.off <= options.max_surface_off &&
         rays.round.median <= kMostMedian &&
         rays.round.squared <= std::max(kMostOfImage * rays.images, kMostOfOwn * rays.own.squared);
}

RaysOfLines RaysOf(const PipeCandidate& candidate, const std::vector<Outline>& outlines) {
  RaysOfLines rays;
  for (const size_t i : candidate.outlines) rays.push_back(&outlines[i].rays);
  return rays;
}

// Those that may be pipes by what the images show, the most widely seen first.
std::vector<JudgedPipe> Judge(const std::vector<PipeCandidate>& candidates,
                              const std::vector<Outline>& outlines, const MapResult& map,
                              const PipeOptions& options) {
  std::vector<JudgedPipe> judged;
  for (const PipeCandidate& candidate : candidates) {
    const Cylinder& cylinder = candidate.fit.cylinder;
    const RaysOfLines lines = RaysOf(candidate, outlines);
    const RayEvidence rays = RayEvidenceOf(cylinder, lines);
    if (rays.both_images < options.min_both_sides * rays.images) continue;
    const SurfaceEvidence surface =
        SurfaceEvidenceOf(cylinder, candidate.from_m, candidate.to_m, lines, map.dense);
    if (IsPipe(cylinder, rays, surface, options)) judged.push_back({&candidate, rays});
  }
  std::ranges::stable_sort(judged, [](const JudgedPipe& a, const JudgedPipe& b) {
    if (a.rays.both_images != b.rays.both_images) return a.rays.both_images > b.rays.both_images;
    return a.rays.round.squared < b.rays.round.squared;
  });
  return judged;
}

// Where the outlines of a pipe are, along its axis, but for short gaps.
std::vector<Stretch> StretchesOf(const PipeCandidate& candidate,
                                 const std::vector<Outline>& outlines) {
  const PointAndDirection& axis = candidate.fit.cylinder.axis;
  std::vector<Stretch> pieces;
  for (const size_t i : candidate.outlines) {
    const PointAndDirection& line = outlines[i].line;
    const double sense = line.direction_world.dot(axis.direction_world) < 0 ? -1 : 1;
    const double middle_m = axis.direction_world.dot(line.point_world - axis.point_world);
    for (const Stretch& piece : outlines[i].pieces) {
      const double a_m = middle_m + sense * piece.from_m, b_m = middle_m + sense * piece.to_m;
      pieces.push_back({std::min(a_m, b_m), std::max(a_m, b_m)});
    }
  }
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
  const PointAndDirection& axis = cylinder.axis;
  if (std::abs(axis.direction_world.dot(outline.line.direction_world)) <
      std::cos(options.max_turn_rad)) {
    return false;
  }
  const double most_m = cylinder.radius_m + kSlack_m + kSigmas * outline.sigma_m;
  const auto is_on = [&](double along_m) {
    const Vector3d p = outline.line.point_world + along_m * outline.line.direction_world;
    const Vector3d way = p - axis.point_world;
    const double at_m = axis.direction_world.dot(way);
    return way.cross(axis.direction_world).norm() <= most_m &&
           std::ranges::any_of(stretches, [&](const Stretch& stretch) {
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
  const bool outlined =
      IsTold(rays, options) && FitsAsWell(rays) && !IsContradicted(cylinder, surface, options);
  return outlined || StandsOut(rays, surface) || StandsFree(rays, surface) ||
         HasRoundSurface(cylinder, rays, surface, options);
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
    const std::vector<Stretch> stretches = StretchesOf(candidate, outlines);
    const size_t before = found.pipes.size();
    AddMapPipes(judged, stretches, outlines, options.min_length_m, &found.pipes);
    if (found.pipes.size() == before) continue;
    for (const size_t i : candidate.outlines) explained[i] = 1;
    for (size_t i = 0; i < outlines.size(); ++i) {
      explained[i] |= IsOnPipe(outlines[i], candidate.fit.cylinder, stretches, options);
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
