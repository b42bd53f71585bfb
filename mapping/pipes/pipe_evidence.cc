#include "mapping/pipes/pipe_evidence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "data/core/math.h"
#include "mapping/pipes/pipe_fit.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMostSquared = 9;
constexpr double kRobustSigmas = 2;

// A ray as seen along an axis, which is at the origin: n . x = d holds where it passes.
struct FlatRay {
  Vector2d n;
  double d_m = 0, sigma_m = 0;
};

FlatRay Flat(const TangentRay& ray, const PointAndDirection& axis, const AcrossAxis& across) {
  const Vector3d normal = ray.ray_world.cross(axis.direction_world).normalized();
  return {across.Direction(normal), (ray.centre_world - axis.point_world).dot(normal), ray.sigma_m};
}

// The place that all rays pass nearest to.
Vector2d FixedEdge(const std::vector<FlatRay>& rays) {
  constexpr int kFitRounds = 5;
  Vector2d place = Vector2d::Zero();
  for (int round = 0; round < kFitRounds; ++round) {
    NearestPlace nearest;
    for (const FlatRay& ray : rays) {
      const double sigmas = (ray.n.dot(place) - ray.d_m) / ray.sigma_m;
      const double robust = round == 0 ? 1 : 1 / (1 + std::pow(sigmas / kRobustSigmas, 2));
      nearest.Add(ray.n, ray.d_m, robust / (ray.sigma_m * ray.sigma_m));
    }
    place = nearest.Solve();
  }
  return place;
}

void AddEdgeMisfits(const std::vector<FlatRay>& rays, std::vector<double>* sigmas) {
  const Vector2d place = FixedEdge(rays);
  for (const FlatRay& ray : rays) {
    sigmas->push_back(std::abs(ray.n.dot(place) - ray.d_m) / ray.sigma_m);
  }
}

Misfit ComputeMisfit(const std::vector<double>& sigmas) {
  Misfit misfit;
  if (sigmas.empty()) return misfit;
  for (const double value : sigmas) misfit.squared += 0.5 * std::min(value * value, kMostSquared);
  misfit.median = Quantile(sigmas, 0.5);
  return misfit;
}

// Rays by the side of the axis that they pass on.
using BothSides = std::vector<FlatRay>[2];
int FindSide(const FlatRay& ray) { return ray.d_m < 0 ? 0 : 1; }

Misfit StraightMisfit(const BothSides& sides) {
  std::vector<double> sigmas;
  for (const auto& side : sides) AddEdgeMisfits(side, &sigmas);
  return ComputeMisfit(sigmas);
}

void CountImages(const std::map<int, std::pair<bool, bool>>& images, RayEvidence* evidence) {
  evidence->images = static_cast<int>(images.size());
  for (const auto& [image, sides] : images) evidence->both_images += sides.first && sides.second;
}

// Between the first and the last of almost all directions.
double ComputeTurn(const std::vector<Vector2d>& ways, const Vector2d& mean) {
  std::vector<double> turns_rad;
  for (const Vector2d& way : ways) {
    turns_rad.push_back(std::atan2(mean.x() * way.y() - mean.y() * way.x(), mean.dot(way)));
  }
  return Quantile(turns_rad, 0.95) - Quantile(turns_rad, 0.05);
}

// Where the views are, as seen along the axis; nothing where they are all around it.
std::optional<Vector2d> WayToViews(const AcrossAxis& across, const RaysOfLines& lines) {
  constexpr double kOneSide_rad = 1.5;
  std::vector<Vector2d> ways;
  Vector2d mean = Vector2d::Zero();
  for (const auto* rays : lines) {
    for (const TangentRay& ray : *rays) {
      ways.push_back(across.Place(ray.centre_world).normalized());
      mean += ways.back();
    }
  }
  if (ways.empty() || ComputeTurn(ways, mean) > kOneSide_rad) return std::nullopt;
  return mean.normalized();
}

// Points about a cylinder by their height and how far they are aside, in radii.
class SurfaceAbout {
 public:
  static constexpr double kReach = 4;

  void Add(double height, double aside) {
    constexpr double kMiddle = 0.7, kBehind = 1.5, kBefore = 2, kBesideFrom = 1.25, kBesideTo = 2.5;
    if (height > kBefore) return;
    const double off = std::abs(aside);
    if (off > kBesideFrom && off < kBesideTo) beside_[aside < 0 ? 0 : 1].push_back(height);
    if (off > kMiddle || height < -kBehind) return;
    heights_.push_back(height);
    offs_.push_back(std::abs(height - std::sqrt(1 - off * off)));
  }

  SurfaceEvidence Evidence() const {
    constexpr size_t kLeastBeside = 10;
    SurfaceEvidence evidence;
    for (const std::vector<double>& side : beside_) {
      if (side.size() < kLeastBeside) continue;
      evidence.beside = std::max(evidence.beside, Quantile(side, 0.5));
    }
    evidence.points = static_cast<int>(heights_.size());
    if (heights_.empty()) return evidence;
    evidence.height = Quantile(heights_, 0.5);
    evidence.highest = Quantile(heights_, 0.85);
    evidence.off = Quantile(offs_, 0.5);
    return evidence;
  }

 private:
  std::vector<double> heights_, offs_, beside_[2];
};

}  // namespace

RayEvidence CollectRayEvidence(const Cylinder& cylinder, const RaysOfLines& lines) {
  const AcrossAxis across(cylinder.axis);
  BothSides measured, touching;
  std::vector<double> round, own;
  std::map<int, std::pair<bool, bool>> images;
  for (const auto* rays : lines) {
    std::vector<FlatRay> of_line;
    for (const TangentRay& ray : *rays) {
      FlatRay flat = Flat(ray, cylinder.axis, across);
      const int side = FindSide(flat);
      of_line.push_back(flat);
      measured[side].push_back(flat);
      round.push_back(std::abs(std::abs(flat.d_m) - cylinder.radius_m) / flat.sigma_m);
      flat.d_m = side == 0 ? -cylinder.radius_m : cylinder.radius_m;
      touching[side].push_back(flat);
      (side == 0 ? images[ray.image].first : images[ray.image].second) = true;
    }
    AddEdgeMisfits(of_line, &own);
  }
  RayEvidence evidence;
  evidence.round = ComputeMisfit(round);
  evidence.own = ComputeMisfit(own);
  evidence.straight = StraightMisfit(measured);
  evidence.told = StraightMisfit(touching);
  evidence.outlines = static_cast<int>(round.size()) / 2;  // a ray to each of its ends
  CountImages(images, &evidence);
  return evidence;
}

CloudAboutPipes::CloudAboutPipes(const std::vector<DensePoint>& cloud)
    : cloud_(cloud), index_(cloud) {}

SurfaceEvidence CloudAboutPipes::Of(const Cylinder& cylinder, double from_m, double to_m,
                                    const RaysOfLines& lines) const {
  constexpr double kPiece_m = 1, kSlack_m = 0.01;
  const AcrossAxis across(cylinder.axis);
  const std::optional<Vector2d> to_views = WayToViews(across, lines);
  const double reach_m = SurfaceAbout::kReach * cylinder.radius_m;
  const int pieces = std::max(1, static_cast<int>(std::ceil((to_m - from_m) / kPiece_m)));
  const double step_m = (to_m - from_m) / pieces;
  SurfaceAbout about;
  PointTree::Found found;
  for (int piece = 0; piece < pieces; ++piece) {
    const double start_m = from_m + piece * step_m;
    const bool is_last = piece + 1 == pieces;
    const Vector3d middle =
        cylinder.axis.point_world + (start_m + 0.5 * step_m) * cylinder.axis.direction_world;
    index_.FindWithin(middle.cast<float>(), std::hypot(0.5 * step_m, reach_m) + kSlack_m, &found);
    for (const int i : found.items) {
      const DensePoint& point = cloud_[i];
      const Vector3d way = point.p_world - cylinder.axis.point_world;
      const double along_m = cylinder.axis.direction_world.dot(way) - start_m;
      if (along_m < 0 || along_m > step_m || (along_m == step_m && !is_last)) continue;
      const Vector2d place = across.Direction(way);
      if (place.squaredNorm() > reach_m * reach_m) continue;
      // Normals look at the views that saw a point.
      const Vector2d facing =
          to_views ? *to_views : Vector2d(across.Direction(point.normal_world).normalized());
      about.Add(place.dot(facing) / cylinder.radius_m,
                (facing.x() * place.y() - facing.y() * place.x()) / cylinder.radius_m);
    }
  }
  SurfaceEvidence evidence = about.Evidence();
  evidence.length_m = to_m - from_m;
  return evidence;
}

namespace {

// The images tell it from an edge on each side.
bool RulesOutEdges(const RayEvidence& rays, const PipeOptions& options) {
  constexpr double kLeastTold = 0.08, kLeastSquared = 15, kLeastShare = 0.5;
  const bool by_most = rays.straight.median >= options.min_gain * rays.round.median &&
                       rays.told.median >= kLeastTold;
  const double gain = rays.straight.squared - rays.round.squared;
  return by_most || (rays.told.squared >= kLeastSquared && gain >= kLeastShare * rays.told.squared);
}

constexpr double kEdgeSlack = 1.3, kEdgeFew = 3;

// As a whole, the rays fit the cylinder about as well as an edge on each side.
bool FitsAsEdges(const RayEvidence& rays) {
  return rays.round.squared <= kEdgeSlack * rays.straight.squared + kEdgeFew;
}

// Neither an edge on each side nor one for each line does better.
bool FitsNoWorse(const RayEvidence& rays) {
  return FitsAsEdges(rays) && rays.round.median <= kEdgeSlack * rays.own.median &&
         rays.round.squared <= rays.outlines;
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
  constexpr double kMostMedian = 0.2;
  constexpr int kLeastPoints = 60;
  constexpr double kMostOff = 0.55, kLeastHighest = 0.7, kMostHighest = 1.1, kBehind = -0.3;
  return rays.round.median <= kMostMedian && FitsAsEdges(rays) && surface.points >= kLeastPoints &&
         surface.off <= kMostOff && surface.highest >= kLeastHighest &&
         surface.highest <= kMostHighest && surface.beside <= kBehind;
}

// Where the views should tell it from edges, and edges do better nevertheless.
bool PrefersEdges(const RayEvidence& rays) {
  constexpr double kTold = 15, kLeastShare = 0.3;
  return rays.told.squared >= kTold &&
         rays.straight.squared - rays.round.squared < kLeastShare * rays.told.squared;
}

// The cloud bulges between the outlines nearly as a pipe does, and is behind beside them; from one
// side the outlines need not say more than that a pipe fits about as well as edges do.
bool IsConvexByDepth(const Cylinder& cylinder, const RayEvidence& rays,
                     const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 30, kLeastPoints = 80;
  constexpr double kLeastBoth = 0.7, kMostOfOwn = 2.5;
  constexpr double kLeastLength_m = 1.5, kLeastRadius_m = 0.05;
  constexpr double kLeastHeight = 0.3, kLeastHighest = 0.55, kMostHighest = 1.2, kMostOff = 0.52;
  constexpr double kBehind = -0.5;
  return cylinder.radius_m >= kLeastRadius_m && surface.length_m >= kLeastLength_m &&
         rays.images >= kLeastImages && rays.both_images >= kLeastBoth * rays.images &&
         FitsAsEdges(rays) && rays.round.squared <= kMostOfOwn * rays.own.squared + kEdgeFew &&
         surface.points >= kLeastPoints && surface.height >= kLeastHeight &&
         surface.highest >= kLeastHighest && surface.highest <= kMostHighest &&
         surface.off <= kMostOff && surface.beside <= kBehind && !PrefersEdges(rays);
}

// A long bar that nearly all images show both outlines of, and that all that is known beside it is
// behind. What of the cloud is on it bulges, though much of it is torn to what is behind: so may a
// flat strip, or a square bar seen from one side alone, but these seldom stand as free.
bool IsFreeBar(const RayEvidence& rays, const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 60, kLeastPoints = 150;
  constexpr double kLeastBoth = 0.85, kLeastHeight = 0.15, kLeastHighest = 0.45, kMostHighest = 1.1,
                   kBehind = -1;
  return rays.images >= kLeastImages && rays.both_images >= kLeastBoth * rays.images &&
         FitsAsEdges(rays) && surface.points >= kLeastPoints && surface.height >= kLeastHeight &&
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
  const bool outlined = RulesOutEdges(rays, options) && FitsNoWorse(rays) &&
                        !IsContradicted(cylinder, surface, options);
  if (outlined) return true;
  return !rays.has_ridge && (StandsOut(rays, surface) || IsConvexByDepth(cylinder, rays, surface) ||
                             IsFreeBar(rays, surface));
}

bool HasPipeWidth(const Cylinder& cylinder, const WidthEvidence& widths,
                  const SurfaceEvidence& surface) {
  constexpr int kLeastImages = 10;
  constexpr double kLeastShareOfTold = 0.4, kLeastGain = 2, kMostOfImage = 1.6;
  constexpr double kSlack = 1.1, kFew = 5, kMostOtherRadius = 0.1;
  return widths.images >= kLeastImages && widths.told >= kLeastEdgeMisfit &&
         widths.edges - widths.cylinder >= kLeastShareOfTold * widths.told &&
         widths.edges >= kLeastGain * widths.cylinder &&
         widths.cylinder <= kMostOfImage * widths.images &&
         widths.cylinder <= kSlack * widths.bar + kFew &&
         std::abs(widths.radius_m - cylinder.radius_m) <= kMostOtherRadius * cylinder.radius_m &&
         !IsFlat(cylinder, surface);
}

}  // namespace slcmap::mapping
