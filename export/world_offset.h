// Where maps of poses that were given far from their origin, as in UTM, lie: what files can say.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <string>

#include "mapping/map.h"

namespace slcmap {

inline bool IsFar(const MapSource& source) { return !source.world_offset_m.isZero(); }

// "world_offset_m 451200 5411300 312"; "" of maps that are where their poses were given.
inline std::string WorldOffsetNote(const Eigen::Vector3d& offset_m) {
  if (offset_m.isZero()) return "";
  return fmt::format("world_offset_m {:.0f} {:.0f} {:.0f}", offset_m.x(), offset_m.y(),
                     offset_m.z());
}

}  // namespace slcmap
