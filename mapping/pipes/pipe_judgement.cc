#include "mapping/pipes/pipe_judgement.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

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
         ShowsBothSides(rays) && surface.height >= kLeastHeight &&
         surface.off <= options.max_surface_off && rays.round.median <= kMostMedian &&
         rays.round.squared <= std::max(kMostOfImage * rays.images, kMostOfOwn * rays.own.squared);
}

}  // namespace

bool ShowsBothSides(const RayEvidence& rays) {
  constexpr double kLeastShare = 0.2;
  return rays.both_images >= kLeastShare * rays.images;
}

bool IsFlat(const Cylinder& cylinder, const SurfaceEvidence& surface) {
  constexpr double kMostHighest = 0.4;
  constexpr int kLeastPoints = 50;
  return cylinder.radius_m >= kLeastRadiusOfCloud_m && surface.points >= kLeastPoints &&
         surface.highest < kMostHighest;
}

bool IsPipe(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface,
            const PipeOptions& options) {
  if (HasRoundSurface(cylinder, rays, surface, options)) return true;
  if (cylinder.radius_m < options.min_outlined_radius_m) return false;
  if (rays.both_images < options.min_both_sides * rays.images) return false;
  const bool outlined =
      IsTold(rays, options) && FitsAsWell(rays) && !IsContradicted(cylinder, surface, options);
  if (outlined) return true;
  return !rays.has_ridge &&
         (StandsOut(rays, surface) || Bulges(cylinder, rays, surface) || StandsFree(rays, surface));
}

bool IsAsWideAsAPipe(const Cylinder& cylinder, const WidthEvidence& widths,
                     const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 10;
  constexpr double kLeastShareOfTold = 0.4, kLeastGain = 2, kMostOfImage = 1.6;
  constexpr double kSlack = 1.1, kFew = 5, kMostOtherRadius = 0.1;
  return widths.images >= kLeastImages && widths.told >= kLeastToldByWidths &&
         widths.edges - widths.cylinder >= kLeastShareOfTold * widths.told &&
         widths.edges >= kLeastGain * widths.cylinder &&
         widths.cylinder <= kMostOfImage * widths.images &&
         widths.cylinder <= kSlack * widths.bar + kFew &&
         std::abs(widths.radius_m - cylinder.radius_m) <= kMostOtherRadius * cylinder.radius_m &&
         !IsFlat(cylinder, surface);
}

}  // namespace slcmap
