// Which of many maps overlap, and about where, by their indexes of places alone.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "mapping/align/align_maps.h"
#include "mapping/map/place_index.h"

namespace slcmap::inline mapping {

// How likely it is that a second map shows a part of what a first one shows.
struct MapOverlap {
  // Natural logarithm of the odds, with all the places counted where it could lie by chance; below
  // zero it is as likely as not by chance alone.
  double log_odds = -1e9;
  RoughStart start;  // of the second in the first, where it fits best
};

// An index that is ready to be compared with others.
class IndexedMap {
 public:
  explicit IndexedMap(const PlaceIndex& index);
  ~IndexedMap();
  IndexedMap(IndexedMap&&) noexcept;

  // Upright edges vote for turns and shifts in the plan, level ones for heights; where most fall on
  // their like, all edges are compared. Deterministic, some milliseconds. Twins, as look-alike
  // storeys, overlap as well as what is the same.
  MapOverlap FindOverlap(const IndexedMap& second) const;

  // The share of the second's walk that goes where this one's does, within a distance and on one
  // storey.
  double ShareOfWalk(const IndexedMap& second, const RigidTransform& T_this_second) const;

  // The height at which most of the walk is, its middle, and how many places it has.
  double WalkHeight_m() const;
  Eigen::Vector3d WalkMiddle() const;
  std::size_t WalkPlaces() const;

 private:
  struct Contents;
  std::unique_ptr<const Contents> contents_;
};

// Two of many maps, by their numbers; the first is the lower one.
struct MapPair {
  std::size_t first = 0, second = 0;
  MapOverlap overlap;
};

// A map with each of those before it, the likeliest first.
std::vector<MapPair> FindOverlaps(const std::vector<IndexedMap>& maps, std::size_t map);

}  // namespace slcmap::mapping
