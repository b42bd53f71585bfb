// Two maps aligned, and where maps of a group lie by all pairs of them that were.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/align/place_maps.h"

namespace slcmap::inline mapping {

// What a map bends by, so that chains of maps do not close better.
inline constexpr double kMapSigma_m = 0.015, kMapSigma_rad = 0.002;

// What the maps' places differ by from what a pair says: the turn in rad, then the shift in metres
// at the middle of what the two share.
Eigen::Vector4d ComputeOff(const AlignedPair& pair, const std::vector<PlacedMap>& placed);

// Least squares over the turns and translations of maps of one group, of what the pairs are off by.
// The first map stays.
void AdjustPairs(const std::vector<const AlignedPair*>& pairs, const std::vector<std::size_t>& maps,
                 std::vector<PlacedMap>* placed);

// As AlignMaps, with what it throws of two maps as the reason. About where their places on Earth
// say, if there is that; not far from there.
AlignedPair AlignTwo(const ComparedMap& first, const ComparedMap& second,
                     const std::optional<RigidTransform>& T_on_earth = {},
                     const Progress& progress = {});

}  // namespace slcmap::mapping
