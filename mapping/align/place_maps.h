// Where many maps lie to each other: few pairs of them are aligned, and what the pairs say has to
// agree.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/place_index.h"

namespace slcmap::inline mapping {

struct MapToPlace {
  std::string name;    // as messages have it
  std::string storey;  // "": not said. Maps of one storey are at one height, those of others not
  PlaceIndex index;
  std::optional<Georeference> on_earth = {};
};

// What the alignment of two maps by their numbers gave.
struct AlignedPair {
  std::size_t first = 0, second = 0;
  std::optional<MapAlignment> found;
  std::string reason = {};                  // where nothing was found
  std::vector<RigidTransform> places = {};  // where the second fits here and there
};
using AlignPair = std::function<AlignedPair(std::size_t first, std::size_t second)>;

struct PlacedMap {
  std::size_t group = 0;       // the lowest number of the maps that it lies together with
  RigidTransform T_group_map;  // into the world of that map; a turn about z, and a translation
};

struct PairApart {
  std::size_t first = 0, second = 0;
  std::string reason;
};

struct MapPlacement {
  std::vector<PlacedMap> maps;
  std::vector<PairApart> apart;  // of different groups, or against what the others of a group say
  std::size_t tried = 0, used = 0;  // pairs
  double closing_m = 0;  // root mean square of what the pairs are off by after the adjustment
};

// Tries each map with up to four of those before it that it is likely to overlap, then groups that
// are likely to overlap with each other. Groups grow where the pairs between two of them agree with
// each other: by turn, shift and height within what is known of them. Refused are a pair against
// which more of the others speak, maps whose storeys do not allow it, and maps that may be twins:
// where a third map has two places for one of them, of which the other shows one alone. The pairs
// that are left are adjusted together. Groups that share nothing, as storeys without a walk between
// them, lie to each other as their places on Earth say, where these agree. Deterministic. Throws
// StoppedError once progress says so.
MapPlacement PlaceMaps(const std::vector<MapToPlace>& maps, const AlignPair& align,
                       const Progress& progress = {});

}  // namespace slcmap::mapping
