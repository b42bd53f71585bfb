#include "mapping/align/place_maps.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include "data/core/math.h"
#include "mapping/align/map_overlap.h"
#include "mapping/align/pair_adjustment.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

// Pairs that a map is tried with, of those before it; the least where hardly any is likely. Then
// those of two groups, after which these stay apart.
constexpr std::size_t kMostPairs = 4, kLeastPairs = 2, kMostPairsOfGroups = 2;

constexpr double kClosingSigmas = 4;

// Pairs that agree on a place have to be worth as many times those that do not. Two maps that were
// there, but did not fit, are worth half a pair.
constexpr double kLeastMajority = 2, kNotFittingWorth = 0.5;
constexpr double kSharedWalk = 0.5;  // of maps that should fit, and of one that shows a place

// Maps of one storey are nearer to each other in height than this, those of two farther apart.
constexpr double kHalfStorey_m = 1.5;
constexpr double kSameTwin_m = 0.5;  // where two maps say that a third is

// Of two places on Earth, each by some control points; and what a pair of them is worth. Of one,
// beside those of other maps.
constexpr double kEarthSigma_m = 0.03, kEarthSigma_rad = 0.005, kWorthOnEarth = 10;
constexpr double kPlaceSigma_m = 0.01, kPlaceSigma_rad = 0.001;

double TurnBetween_rad(const RigidTransform& a, const RigidTransform& b) {
  return std::abs(ComputeYaw(a.Inverse() * b));
}

double Support(const MapAlignment& found) { return found.surfaces_m2 + found.lines_m; }

// By the places of both on Earth, not by what they show.
bool IsOnEarth(const AlignedPair& pair) { return pair.found && pair.found->surfaces_m2 == 0; }

// Of the place of the alignment's middle, and of its turn.
struct PairVariance {
  double shift_m2 = 0, turn_rad2 = 0;
};

PairVariance ComputeVariance(const MapAlignment& found) {
  const Eigen::Matrix4d covariance = found.information.of_turn_and_shift.inverse();
  if (!covariance.allFinite()) return {};
  return {covariance.diagonal().tail<3>().mean(), covariance(0, 0)};
}

class MapPlacer {
 public:
  MapPlacer(const std::vector<MapToPlace>& maps, const AlignPair& align, const Progress& progress)
      : maps_(maps), align_(align), progress_(progress) {
    for (const MapToPlace& map : maps) indexed_.emplace_back(map.index);
  }

  MapPlacement Place() {
    for (std::size_t map = 1; map < maps_.size(); ++map) TryLikeliest(map);
    FindGroups();
    while (TryGroups()) FindGroups();
    JoinOnEarth();
    return Finish();
  }

 private:
  void Try(std::size_t first, std::size_t second) {
    progress_.ReportOrStop(static_cast<double>(pairs_.size()) /
                           static_cast<double>(kMostPairs * maps_.size() + pairs_.size()));
    if (!tried_.insert({first, second}).second) return;
    pairs_.push_back(align_(first, second));
    pairs_.back().first = first;
    pairs_.back().second = second;
    const AlignedPair& pair = pairs_.back();
    if (!pair.found && maps_.size() == 2) return;  // what refuses the two says why
    spdlog::info("{} and {}: {}", maps_[first].name, maps_[second].name,
                 pair.found ? fmt::format("{:.0f} m2 and {:.0f} m agree", pair.found->surfaces_m2,
                                          pair.found->lines_m)
                            : pair.reason);
  }

  void TryLikeliest(std::size_t map) {
    const std::vector<MapPair> overlaps = FindOverlaps(indexed_, map);
    for (std::size_t i = 0; i < overlaps.size(); ++i) {
      const bool is_likely = overlaps[i].overlap.log_odds > 0;
      if (i < kLeastPairs || (i < kMostPairs && is_likely)) {
        Try(overlaps[i].first, map);
      } else if (is_likely) {
        others_.push_back(overlaps[i]);
      }
    }
  }

  // Likely pairs of groups that are apart. False where all that is worth it was tried.
  bool TryGroups() {
    std::ranges::stable_sort(others_, std::greater(),
                             [](const MapPair& pair) { return pair.overlap.log_odds; });
    for (const MapPair& pair : others_) {
      const auto groups = std::minmax(placed_[pair.first].group, placed_[pair.second].group);
      if (groups.first == groups.second || tried_.contains({pair.first, pair.second})) continue;
      const auto of_groups = std::ranges::count_if(pairs_, [&](const AlignedPair& tried) {
        return std::minmax(placed_[tried.first].group, placed_[tried.second].group) == groups;
      });
      if (static_cast<std::size_t>(of_groups) >= kMostPairsOfGroups) continue;
      Try(pair.first, pair.second);
      return true;
    }
    return false;
  }

  // Anew, by all pairs so far: those with most in common first.
  void FindGroups() {
    placed_.resize(maps_.size());
    for (std::size_t i = 0; i < maps_.size(); ++i) placed_[i] = {i, {}};
    against_.clear();
    std::vector<const AlignedPair*> found;
    for (const AlignedPair& pair : pairs_) {
      if (pair.found) found.push_back(&pair);
    }
    std::ranges::stable_sort(found, std::greater(),
                             [](const AlignedPair* pair) { return Support(*pair->found); });
    FindSuspects(found);
    bool has_grown = true;
    while (has_grown) {
      has_grown = std::ranges::any_of(found, [&](const AlignedPair* pair) { return Join(*pair); });
    }
  }

  // Three maps of which each pair was found: whether the third pair says what the others do.
  bool Closes(const AlignedPair& ab, const AlignedPair& bc, const AlignedPair& ac) const {
    const Vector3d at = ac.found->T_first_second.Inverse() * ac.found->information.centre_first;
    return Agrees(ac, ac.found->T_first_second, ab.found->T_first_second * bc.found->T_first_second,
                  at, 3);
  }

  std::string JoinNames(const std::array<const AlignedPair*, 3>& pairs) const {
    std::set<std::size_t> maps;
    for (const AlignedPair* pair : pairs) maps.insert({pair->first, pair->second});
    std::vector<std::string> names;
    for (const std::size_t map : maps) names.push_back(maps_[map].name);
    return fmt::format("{}", fmt::join(names, ", "));
  }

  // The place of one map of a pair in the other.
  static RigidTransform PlaceIn(const AlignedPair& pair, std::size_t map) {
    const RigidTransform& T = pair.found->T_first_second;
    return pair.second == map ? T : T.Inverse();
  }

  // Whether a third map has looked at where a pair has its second, and fits to that elsewhere.
  bool IsRefuted(const AlignedPair& pair, const std::array<const AlignedPair*, 3>& three) const {
    const auto with = [&](std::size_t map) {
      return *std::ranges::find_if(three, [&](const AlignedPair* other) {
        return other != &pair && (other->first == map || other->second == map);
      });
    };
    const AlignedPair &to_first = *with(pair.first), &to_second = *with(pair.second);
    const std::size_t third = to_first.first == pair.first ? to_first.second : to_first.first;
    const IndexedMap &by = indexed_[third], &of = indexed_[pair.second];
    const RigidTransform T_by_pair = PlaceIn(to_first, pair.first) * pair.found->T_first_second;
    return by.ShareOfWalk(of, T_by_pair) > kSharedWalk &&
           by.ShareOfWalk(of, PlaceIn(to_second, pair.second)) > kSharedWalk;
  }

  // Of three pairs that do not close, those that close no other three: one that is worth much less
  // than the others, or that alone is refuted by the third map, is wrong, else it cannot be told
  // which is, and none is taken.
  void FindSuspects(const std::vector<const AlignedPair*>& found) {
    using Three = std::array<const AlignedPair*, 3>;
    std::map<std::pair<std::size_t, std::size_t>, const AlignedPair*> by_maps;
    for (const AlignedPair* pair : found) by_maps[{pair->first, pair->second}] = pair;
    std::vector<Three> broken;
    std::set<const AlignedPair*> closing;
    for (const auto& [ac, pair] : by_maps) {
      for (std::size_t b = ac.first + 1; b < ac.second; ++b) {
        const auto ab = by_maps.find({ac.first, b}), bc = by_maps.find({b, ac.second});
        if (ab == by_maps.end() || bc == by_maps.end()) continue;
        const Three three = {ab->second, bc->second, pair};
        if (Closes(*ab->second, *bc->second, *pair)) {
          closing.insert(three.begin(), three.end());
        } else {
          broken.push_back(three);
        }
      }
    }
    suspects_.clear();
    for (Three three : broken) {
      std::ranges::stable_sort(three, {},
                               [](const AlignedPair* pair) { return Support(*pair->found); });
      std::vector<const AlignedPair*> in_doubt;
      std::ranges::copy_if(three, std::back_inserter(in_doubt),
                           [&](const AlignedPair* pair) { return !closing.contains(pair); });
      if (in_doubt.size() > 1 &&
          Support(*in_doubt[1]->found) >= kLeastMajority * Support(*in_doubt[0]->found)) {
        in_doubt.resize(1);
      }
      std::vector<const AlignedPair*> refuted;
      std::ranges::copy_if(in_doubt, std::back_inserter(refuted),
                           [&](const AlignedPair* pair) { return IsRefuted(*pair, three); });
      if (refuted.size() == 1) in_doubt = refuted;
      for (const AlignedPair* pair : in_doubt) {
        suspects_.insert(pair);
        against_[pair] =
            fmt::format("found the pairs of {} not to agree on one place; expected three that do",
                        JoinNames(three));
      }
    }
  }

  // The group of the second in that of the first, as a pair says.
  RigidTransform BetweenGroups(const AlignedPair& pair) const {
    return placed_[pair.first].T_group_map * pair.found->T_first_second *
           placed_[pair.second].T_group_map.Inverse();
  }

  // Whether the maps of the groups of a pair are now of one.
  bool Join(const AlignedPair& pair) {
    const std::size_t first = placed_[pair.first].group, second = placed_[pair.second].group;
    if (first == second || suspects_.contains(&pair)) return false;
    const RigidTransform T_first_second = BetweenGroups(pair);
    for (const auto& refusal : {FindTwin(pair), FindContradiction(pair, T_first_second),
                                FindWrongHeight(first, second, T_first_second)}) {
      if (refusal.empty()) continue;
      against_[&pair] = refusal;
      return false;
    }
    const bool is_first_lower = first < second;
    const RigidTransform T_lower_upper = is_first_lower ? T_first_second : T_first_second.Inverse();
    const auto [lower, upper] = std::minmax(first, second);
    for (PlacedMap& map : placed_) {
      if (map.group == upper) map = {lower, T_lower_upper * map.T_group_map};
    }
    return true;
  }

  std::size_t CountMaps(std::size_t group) const {
    return static_cast<std::size_t>(std::ranges::count(placed_, group, &PlacedMap::group));
  }

  // Whether a pair is where others say, within what is known of it and of the maps between.
  bool Agrees(const AlignedPair& pair, const RigidTransform& T_by_pair,
              const RigidTransform& T_by_others, const Vector3d& at, std::size_t maps) const {
    const PairVariance variance = ComputeVariance(*pair.found);
    const double between = 2 + std::log2(static_cast<double>(maps));
    const double shift_m = std::sqrt(variance.shift_m2 + between * std::pow(kMapSigma_m, 2)),
                 turn_rad = std::sqrt(variance.turn_rad2 + between * std::pow(kMapSigma_rad, 2));
    return (T_by_pair * at - T_by_others * at).norm() < kClosingSigmas * shift_m &&
           TurnBetween_rad(T_by_pair, T_by_others) < kClosingSigmas * turn_rad;
  }

  // Where in its second's group a pair's middle is.
  Vector3d FindMiddle(const AlignedPair& pair) const {
    return placed_[pair.second].T_group_map *
           (pair.found->T_first_second.Inverse() * pair.found->information.centre_first);
  }

  // All pairs between two groups, against what one of them says.
  std::string FindContradiction(const AlignedPair& pair, const RigidTransform& T) const {
    const std::size_t first = placed_[pair.first].group, second = placed_[pair.second].group;
    const std::size_t maps = CountMaps(first) + CountMaps(second);
    double agreeing = 0, differing = 0;
    const AlignedPair* worst = nullptr;
    for (const AlignedPair& other : pairs_) {
      const std::size_t a = placed_[other.first].group, b = placed_[other.second].group;
      const bool is_between = std::minmax(a, b) == std::minmax(first, second);
      if (!is_between || suspects_.contains(&other)) continue;
      if (IsOnEarth(pair) && !IsOnEarth(other) && against_.contains(&other)) continue;
      const RigidTransform T_of_groups = a == first ? T : T.Inverse();
      if (!other.found) {
        if (!ShouldFit(other, T_of_groups)) continue;
        differing += kNotFittingWorth * Support(*pair.found);
      } else if (Agrees(other, BetweenGroups(other), T_of_groups, FindMiddle(other), maps)) {
        agreeing += Support(*other.found);
        continue;
      } else {
        differing += Support(*other.found);
      }
      if (!worst || (other.found && !worst->found)) worst = &other;
    }
    if (!worst || agreeing >= kLeastMajority * differing) return "";
    return fmt::format("found {} and {} {}; expected pairs that agree by more than {:.0f} to one",
                       maps_[worst->first].name, maps_[worst->second].name,
                       worst->found ? "to say another place" : "not to fit to each other there",
                       kLeastMajority);
  }

  // Two maps that do not fit, although both were there.
  bool ShouldFit(const AlignedPair& pair, const RigidTransform& T_first_second) const {
    if (!pair.places.empty()) return false;
    const RigidTransform T = placed_[pair.first].T_group_map.Inverse() * T_first_second *
                             placed_[pair.second].T_group_map;
    return indexed_[pair.first].ShareOfWalk(indexed_[pair.second], T) > kSharedWalk;
  }

  // The storeys that are said, and the heights that the groups would have.
  std::string FindWrongHeight(std::size_t first, std::size_t second,
                              const RigidTransform& T_first_second) const {
    std::vector<std::pair<std::size_t, double>> heights_m;
    for (std::size_t i = 0; i < maps_.size(); ++i) {
      const bool is_second = placed_[i].group == second;
      if (maps_[i].storey.empty() || (placed_[i].group != first && !is_second)) continue;
      heights_m.emplace_back(i, indexed_[i].WalkHeight_m() +
                                    placed_[i].T_group_map.translation.z() +
                                    (is_second ? T_first_second.translation.z() : 0));
    }
    for (const auto& [a, a_m] : heights_m) {
      for (const auto& [b, b_m] : heights_m) {
        const bool is_same = maps_[a].storey == maps_[b].storey;
        if (a >= b || is_same == (std::abs(a_m - b_m) < kHalfStorey_m)) continue;
        return fmt::format(
            "found {} of storey {} and {} of storey {} {:.2f} m apart in height, expected {} than "
            "{} m",
            maps_[a].name, maps_[a].storey, maps_[b].name, maps_[b].storey, std::abs(a_m - b_m),
            is_same ? "less" : "more", kHalfStorey_m);
      }
    }
    return "";
  }

  // Where the second may be in the first by a pair of two, whichever is its first; none where that
  // is not in question.
  static std::vector<RigidTransform> ListPlaces(const AlignedPair& pair, std::size_t map) {
    std::vector<RigidTransform> places = pair.places;
    if (pair.first != map) return places;
    for (RigidTransform& T : places) T = T.Inverse();
    return places;
  }

  // A third map that has two places for one of the pair, where the other does not tell which.
  std::string FindTwin(const AlignedPair& pair) const {
    if (IsOnEarth(pair)) return "";
    const std::string &a = maps_[pair.first].storey, &b = maps_[pair.second].storey;
    if (!a.empty() && a == b) return "";
    for (const AlignedPair& doubt : pairs_) {
      if (doubt.places.empty()) continue;
      for (const std::size_t map : {pair.first, pair.second}) {
        if (doubt.first != map && doubt.second != map) continue;
        const std::size_t third = doubt.first == map ? doubt.second : doubt.first;
        // It is the smaller one that has two places in the other.
        if (indexed_[map].WalkPlaces() > indexed_[third].WalkPlaces()) continue;
        if (third == pair.first || third == pair.second || !IsTwin(pair, map, third, doubt)) {
          continue;
        }
        return fmt::format(
            "found two places for {} in {}, of which {} tells nothing, as where storeys look "
            "alike; "
            "expected maps that tell them apart, or their storeys in a site file",
            maps_[map].name, maps_[third].name,
            maps_[map == pair.first ? pair.second : pair.first].name);
      }
    }
    return "";
  }

  // Whether a map of a pair has places in a third one of which the other map shows one alone, or
  // has the same ones.
  bool IsTwin(const AlignedPair& pair, std::size_t map, std::size_t third,
              const AlignedPair& doubt) const {
    const std::size_t other = map == pair.first ? pair.second : pair.first;
    const RigidTransform T_other_map =
        map == pair.second ? pair.found->T_first_second : pair.found->T_first_second.Inverse();
    const std::vector<RigidTransform> places = ListPlaces(doubt, map);
    for (const AlignedPair& tie : pairs_) {
      if (std::minmax(tie.first, tie.second) != std::minmax(other, third)) continue;
      // Where the third map has the other one.
      std::vector<RigidTransform> of_other = ListPlaces(tie, other);
      if (tie.found) of_other.push_back(PlaceIn(tie, other));
      std::size_t alike = 0, hidden = 0;
      for (const RigidTransform& T_third_map : places) {
        const bool is_alike = std::ranges::any_of(of_other, [&](const RigidTransform& T) {
          const RigidTransform T_by_pair = T * T_other_map;
          return (T_by_pair.translation - T_third_map.translation).norm() < kSameTwin_m;
        });
        alike += is_alike ? 1 : 0;
        if (is_alike || !tie.found) continue;
        const RigidTransform T = of_other.front().Inverse() * T_third_map;
        hidden += indexed_[other].ShareOfWalk(indexed_[map], T) < kSharedWalk ? 1 : 0;
      }
      if (alike > 1 || (alike == 1 && hidden > 0)) return true;
    }
    return false;
  }

  // Groups that share nothing, as their places on Earth say, as far as these agree.
  void JoinOnEarth() {
    const std::size_t known = pairs_.size();
    for (std::size_t a = 0; a < maps_.size(); ++a) {
      for (std::size_t b = a + 1; b < maps_.size(); ++b) {
        if (placed_[a].group == placed_[b].group) continue;
        if (const auto pair = PairOnEarth(a, b, kEarthSigma_m, kEarthSigma_rad)) {
          pairs_.push_back(*pair);
        }
      }
    }
    for (std::size_t i = known; i < pairs_.size(); ++i) Join(pairs_[i]);
  }

  std::optional<AlignedPair> PairOnEarth(std::size_t a, std::size_t b, double sigma_m,
                                         double sigma_rad) const {
    const auto T_a_b = BetweenPlaces(maps_[a].on_earth, maps_[b].on_earth);
    if (!T_a_b) return std::nullopt;
    MapAlignment found;
    found.T_first_second = *T_a_b;
    found.lines_m = kWorthOnEarth;
    found.information.centre_first = found.T_first_second * indexed_[b].WalkMiddle();
    found.information.of_turn_and_shift.diagonal()
        << Eigen::Vector4d(sigma_rad, sigma_m, sigma_m, sigma_m).cwiseAbs2().cwiseInverse();
    return AlignedPair{a, b, found};
  }

  // What the places of a group's maps on Earth say of each other, as far as they agree with where
  // the maps are: as much in all as each by itself.
  std::deque<AlignedPair> PairsOnEarth(const std::vector<std::size_t>& maps) const {
    std::deque<AlignedPair> pairs;
    const auto placed = std::ranges::count_if(
        maps, [&](std::size_t map) { return maps_[map].on_earth.has_value(); });
    const double together = std::sqrt(static_cast<double>(placed));
    for (const std::size_t a : maps) {
      for (const std::size_t b : maps) {
        const auto pair =
            a < b ? PairOnEarth(a, b, together * kPlaceSigma_m, together * kPlaceSigma_rad)
                  : std::nullopt;
        if (!pair) continue;
        if (Agrees(*pair, BetweenGroups(*pair), {}, FindMiddle(*pair), maps.size())) {
          pairs.push_back(*pair);
          continue;
        }
        spdlog::warn(
            "{} and {}: found control points to have them {:.2f} m off where what they share has "
            "them, expected less: these points have no say between the two; check them",
            maps_[a].name, maps_[b].name, ComputeOff(*pair, placed_).tail<3>().norm());
      }
    }
    return pairs;
  }

  MapPlacement Finish() {
    MapPlacement placement;
    std::map<std::size_t, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < maps_.size(); ++i) groups[placed_[i].group].push_back(i);
    double squares_m2 = 0;
    for (const auto& [group, maps] : groups) {
      const std::vector<const AlignedPair*> used = PairsWithin(group, maps.size());
      const std::deque<AlignedPair> on_earth = PairsOnEarth(maps);
      std::vector<const AlignedPair*> all = used;
      std::erase_if(all, [](const AlignedPair* pair) { return IsOnEarth(*pair); });
      for (const AlignedPair& pair : on_earth) all.push_back(&pair);
      if (maps.size() > 1) AdjustPairs(all, maps, &placed_);
      for (const AlignedPair* pair : used) {
        squares_m2 += ComputeOff(*pair, placed_).tail<3>().squaredNorm();
      }
      placement.used += used.size();
    }
    placement.closing_m =
        std::sqrt(squares_m2 / static_cast<double>(std::max<std::size_t>(1, placement.used)));
    placement.tried = pairs_.size();
    placement.maps = placed_;
    placement.apart = ListApart();
    return placement;
  }

  // That agree with where the maps of a group are; others are against it.
  std::vector<const AlignedPair*> PairsWithin(std::size_t group, std::size_t maps) {
    std::vector<const AlignedPair*> pairs;
    for (const AlignedPair& pair : pairs_) {
      if (!pair.found || placed_[pair.first].group != group ||
          placed_[pair.second].group != group) {
        continue;
      }
      if (Agrees(pair, BetweenGroups(pair), {}, FindMiddle(pair), maps)) {
        pairs.push_back(&pair);
        against_.erase(&pair);
        continue;
      }
      const Eigen::Vector4d off = ComputeOff(pair, placed_);
      against_[&pair] = fmt::format(
          "found them {:.2f} m and {:.1f} degrees off where the other maps have them, expected "
          "less",
          off.tail<3>().norm(), std::abs(off(0)) * kDegreesPerRadian);
    }
    return pairs;
  }

  std::vector<PairApart> ListApart() const {
    std::vector<PairApart> apart;
    for (const AlignedPair& pair : pairs_) {
      const auto against = against_.find(&pair);
      if (against != against_.end()) {
        apart.push_back({pair.first, pair.second, against->second});
      } else if (placed_[pair.first].group != placed_[pair.second].group) {
        apart.push_back({pair.first, pair.second, pair.reason});
      }
    }
    return apart;
  }

  const std::vector<MapToPlace>& maps_;
  const AlignPair& align_;
  const Progress& progress_;
  std::vector<IndexedMap> indexed_;
  std::set<std::pair<std::size_t, std::size_t>> tried_;
  std::deque<AlignedPair> pairs_;  // stay where they are
  std::vector<MapPair> others_;    // that are likely, but were not tried yet
  std::vector<PlacedMap> placed_;
  std::set<const AlignedPair*> suspects_;
  std::map<const AlignedPair*, std::string> against_;  // of pairs that were found: why not
};

}  // namespace

MapPlacement PlaceMaps(const std::vector<MapToPlace>& maps, const AlignPair& align,
                       const Progress& progress) {
  return MapPlacer(maps, align, progress).Place();
}

}  // namespace slcmap::mapping
