// By what a map is recognised without reading all of it: its long lines and where the rig went, in
// some kB; and its file in a map folder, which mapping/FORMAT.md describes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mapping/map/map.h"

namespace slcmap::inline mapping {

struct PlaceIndex {
  std::vector<MapLine> edges;               // upright or level; of those in files the ends alone
  std::vector<Eigen::Vector3d> walk_world;  // places of the rig, about a metre apart
};

PlaceIndex MakePlaceIndex(const MapResult& map);

inline constexpr const char* kPlaceFile = "places.csv";

// Writes a centimetre exactly. Throws OutputError.
void WritePlaceIndex(const std::string& path, const PlaceIndex& index);

// Of a map folder. Throws DataError naming file and row.
PlaceIndex ReadPlaceIndex(const std::string& folder);

}  // namespace slcmap::mapping
