// The words for kinds of planes and openings, in files of maps and in what is exported.
#pragma once

#include <array>

#include "mapping/building/building.h"

namespace slcmap {

// In the order of the enumerations.
inline constexpr std::array<const char*, 4> kPlaneKinds = {"wall", "floor", "ceiling", "other"};
inline constexpr std::array<const char*, 3> kOpeningKinds = {"door", "window", "passage"};

inline const char* NameOf(PlaneKind kind) { return kPlaneKinds[static_cast<size_t>(kind)]; }
inline const char* NameOf(OpeningKind kind) { return kOpeningKinds[static_cast<size_t>(kind)]; }

}  // namespace slcmap
