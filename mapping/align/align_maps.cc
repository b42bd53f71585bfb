#include "mapping/align/align_maps.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "data/core/math.h"
#include "mapping/align/map_agreement.h"
#include "mapping/align/plan_votes.h"

namespace slcmap::inline mapping {
namespace {

// What the maps have to share.
constexpr double kMinSurfaces_m2 = 4;
constexpr double kMinLines_m = 8;
// Of what both know, the share of surfaces of the one in the free space of the other.
constexpr double kMaxContradiction = 0.12;
constexpr double kMinAgreeing = 0.5;  // of the surfaces of the second that the first knows
// What tells another place from the best one (metres of lines and m2) has to speak for the best:
// for the other at most this share of it, and in all by as much more, and by a share of all that
// agrees. Where maps are held in their place by less than another share, they may slide.
constexpr double kMaxRivalShare = 0.5;
constexpr double kMinTelling = 1.5;
constexpr double kMinTellingShare = 0.05;
constexpr double kMinHoldingShare = 0.015;

constexpr double kSamePose_m = 0.2, kSamePose_rad = 0.03;
constexpr double kContradictionCost = 3;   // of a share of surfaces, as a share of what agrees
constexpr double kRivalContradiction = 2;  // of a rival, as a multiple of what is taken
constexpr double kRivalAgreeing = 0.4;     // of a rival, as a share of what agrees at the best
constexpr double kNudge_m = 0.3;
constexpr double kCandidatesUntil = 0.5;  // share of the time, about

// A place that was fitted and compared.
struct Place {
  AlignmentFit fit;
  MapAgreement agreement;
  double score = 0;
};

class Aligner {
 public:
  Aligner(const ComparedMap& first, const ComparedMap& second, const AlignmentOptions& options,
          const Progress& progress)
      : options_(options), progress_(progress), first_(first), second_(second) {
    for (const LinePlace& place : second.features.lines) centre_ += place.p_world;
    centre_ /= std::max(1.0, static_cast<double>(second.features.lines.size()));
  }

  MapAlignment Align() {
    CheckHeadings();
    std::vector<Place> places = FindPlaces();
    if (places.empty()) FailForOverlap(nullptr);
    Place best = FittedAgain(places.front());
    CheckOverlap(best);
    CheckContradiction(best);
    const double rival_share = CheckRivals(best, places);
    return {best.fit.T_first_second,
            best.agreement.surfaces_m2(),
            best.agreement.lines_m(),
            best.agreement.contradiction(),
            rival_share,
            best.fit.information};
  }

 private:
  void CheckHeadings() const {
    for (const AlignmentFeatures* features : {&first_.features, &second_.features}) {
      if (!features->headings_rad.empty()) continue;
      throw AlignmentError(
          fmt::format("the {} map: found no level lines and upright surfaces, "
                      "expected a building, whose headings tell how maps are turned",
                      features == &first_.features ? "first" : "second"));
    }
  }

  Place PlaceAt(const AlignmentFit& fit) const {
    Place place{fit, Compare(first_, second_, fit.T_first_second)};
    const double agreeing = place.agreement.surfaces_m2() + place.agreement.lines_m();
    place.score =
        agreeing * std::max(0.0, 1 - kContradictionCost * place.agreement.contradiction());
    return place;
  }

  bool IsSamePlace(const RigidTransform& a, const RigidTransform& b) const {
    return (a * centre_ - b * centre_).norm() < kSamePose_m &&
           std::abs(ComputeYaw(a.Inverse() * b)) < kSamePose_rad;
  }

  // The candidates where they come to rest, each once, the best first.
  std::vector<Place> FindPlaces() const {
    std::vector<Place> places;
    const auto candidates = FindCandidates(first_.features, second_.features, options_,
                                           progress_.Part(0, kCandidatesUntil));
    const Progress fitting = progress_.Part(kCandidatesUntil, 1);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      fitting.ReportOrStop(static_cast<double>(i) / static_cast<double>(candidates.size()));
      const auto fit = FitAlignment(first_.index, second_.features, candidates[i].T_first_second,
                                    {.max_samples = 1500});
      if (!fit) continue;
      const auto is_same = [&](const Place& place) {
        return IsSamePlace(place.fit.T_first_second, fit->T_first_second);
      };
      if (std::none_of(places.begin(), places.end(), is_same)) places.push_back(PlaceAt(*fit));
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.score > b.score; });
    for (const Place& place : places) {
      spdlog::debug("place {}: score {:.1f}, {:.1f} m2 and {:.1f} m agree, {:.2f} of what is known",
                    InWords(place.fit.T_first_second), place.score, place.agreement.surfaces_m2(),
                    place.agreement.lines_m(), place.agreement.agreeing_share());
    }
    return places;
  }

  // By all samples.
  Place FittedAgain(const Place& place) const {
    constexpr AlignmentFitOptions kAll{
        .from_m = 0.1, .to_m = 0.04, .steps = 10, .max_samples = 200000};
    const auto fit = FitAlignment(first_.index, second_.features, place.fit.T_first_second, kAll);
    if (!fit) FailForOverlap(&place);
    return PlaceAt(*fit);
  }

  [[noreturn]] void FailForOverlap(const Place* best) const {
    const double surfaces_m2 = best ? best->agreement.surfaces_m2() : 0;
    const double lines_m = best ? best->agreement.lines_m() : 0;
    throw AlignmentError(fmt::format(
        "found no place where the maps overlap: at the best one {:.1f} m2 of surfaces and "
        "{:.1f} m of lines agree; expected at least {} m2 and {} m",
        surfaces_m2, lines_m, kMinSurfaces_m2, kMinLines_m));
  }

  void CheckOverlap(const Place& best) const {
    if (best.agreement.surfaces_m2() < kMinSurfaces_m2 || best.agreement.lines_m() < kMinLines_m) {
      FailForOverlap(&best);
    }
  }

  void CheckContradiction(const Place& best) const {
    const double found = best.agreement.contradiction(), agreeing = best.agreement.agreeing_share();
    if (found <= kMaxContradiction && agreeing >= kMinAgreeing) return;
    throw AlignmentError(fmt::format(
        "found {:.0f} % of the surfaces of one map in the free space of the other at the "
        "best place, {}, and {:.0f} % of those that both know alike; expected at most "
        "{:.0f} % and at least {:.0f} %: are both of one building?",
        100 * found, InWords(best.fit.T_first_second), 100 * agreeing, 100 * kMaxContradiction,
        100 * kMinAgreeing));
  }

  // Other places, and those beside it, as along a blank wall nothing tells where one is. Returns
  // the largest share of a rival.
  double CheckRivals(const Place& best, const std::vector<Place>& places) const {
    double most = 0;
    for (const Place& rival : places) {
      if (IsSamePlace(rival.fit.T_first_second, best.fit.T_first_second)) continue;
      if (!IsRival(best, rival)) continue;
      progress_.ReportOrStop(1);
      const char* advice = options_.start
                               ? "--at reaches both: expected a start from which the wrong one is "
                                 "more than 2 m, 1 m of height or 20 degrees away"
                               : "--at says which";
      most = std::max(most, CheckRival(best, rival, kMinTellingShare, advice));
    }
    for (const Eigen::Vector3d& nudge : Nudges()) {
      progress_.ReportOrStop(1);
      AlignmentFit fit = best.fit;
      fit.T_first_second.translation += nudge;
      most = std::max(most, CheckRival(best, PlaceAt(fit), kMinHoldingShare,
                                       "nothing holds the second map there, so it may slide: "
                                       "expected maps that have more in common"));
    }
    return most;
  }

  // Whether a place has enough for it to be asked about.
  bool IsRival(const Place& best, const Place& rival) const {
    const MapAgreement &a = best.agreement, &b = rival.agreement;
    return b.contradiction() <= kRivalContradiction * kMaxContradiction &&
           b.surfaces_m2() + b.lines_m() >= kRivalAgreeing * (a.surfaces_m2() + a.lines_m());
  }

  static std::vector<Eigen::Vector3d> Nudges() {
    std::vector<Eigen::Vector3d> nudges = {kNudge_m * Eigen::Vector3d::UnitZ(),
                                           -kNudge_m * Eigen::Vector3d::UnitZ()};
    constexpr int kDirections = 16;
    for (int i = 0; i < kDirections; ++i) {
      const double angle_rad = 2 * std::numbers::pi * i / kDirections;
      nudges.emplace_back(kNudge_m * std::cos(angle_rad), kNudge_m * std::sin(angle_rad), 0);
    }
    return nudges;
  }

  // What speaks for the best has to be more by a share of all that agrees there.
  double CheckRival(const Place& best, const Place& rival, double min_share,
                    const char* advice) const {
    const RigidTransform &T_best = best.fit.T_first_second, &T_rival = rival.fit.T_first_second;
    const Telling telling = WhatTells(best.agreement, rival.agreement);
    const double share = telling.for_rival / std::max(telling.for_best, 1e-9);
    const double least = std::max(
        kMinTelling, min_share * (best.agreement.surfaces_m2() + best.agreement.lines_m()));
    spdlog::debug("rival {}: {:.1f} for the best, {:.1f} for it, contradiction {:.3f}",
                  InWords(T_rival), telling.for_best, telling.for_rival,
                  rival.agreement.contradiction());
    if (share < kMaxRivalShare && telling.for_best - telling.for_rival >= least) {
      return share;
    }
    throw AlignmentError(
        fmt::format(
            "found two places where the second map fits: {} and {}; of the lines and "
            "surfaces that tell them apart {:.1f} (m and m2) agree at the one and {:.1f} at "
            "the other, expected at most {:.0f} % of it and {:.1f} less; {}",
            InWords(T_best), InWords(T_rival), telling.for_best, telling.for_rival,
            100 * kMaxRivalShare, least, advice),
        IsSlide(T_best, T_rival) ? std::vector<RigidTransform>() : std::vector{T_best, T_rival});
  }

  // Whether a rival is the best place itself, which nothing holds.
  bool IsSlide(const RigidTransform& best, const RigidTransform& rival) const {
    return (best * centre_ - rival * centre_).norm() < 2 * kNudge_m;
  }

  // As --at takes it.
  static std::string InWords(const RigidTransform& T) {
    const Eigen::Vector3d& t = T.translation;
    return fmt::format("{:.2f},{:.2f},{:.2f},{:.1f}", t.x(), t.y(), t.z(), ComputeYaw(T) / kDegree);
  }

  const AlignmentOptions& options_;
  const Progress& progress_;
  const ComparedMap first_, second_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();  // of the second map
};

}  // namespace

MapAlignment AlignMaps(const ComparedMap& first, const ComparedMap& second,
                       const AlignmentOptions& options, const Progress& progress) {
  return Aligner(first, second, options, progress).Align();
}

std::optional<RigidTransform> BetweenPlaces(const std::optional<Georeference>& first,
                                            const std::optional<Georeference>& second) {
  if (!first || !second || first->crs != second->crs) return std::nullopt;
  Eigen::Vector3d shift = LevelTransform(-first->turn_rad, Eigen::Vector3d::Zero()).rotation *
                          (second->origin_m - first->origin_m);
  shift.head<2>() /= first->scale;
  return LevelTransform(second->turn_rad - first->turn_rad, shift);
}

MapAlignment AlignMaps(const MapResult& first, const MapResult& second,
                       const AlignmentOptions& options, const Progress& progress) {
  const AlignmentFeatures ours = FindFeatures(first), theirs = FindFeatures(second);
  const FeatureIndex our_index(ours), their_index(theirs);
  return AlignMaps(ComparedMap{ours, our_index, first.occupancy},
                   ComparedMap{theirs, their_index, second.occupancy}, options, progress);
}

}  // namespace slcmap::mapping
