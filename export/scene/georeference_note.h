// Where maps lie in a grid: what all files can say.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <optional>
#include <string>

#include "data/core/coordinate_system.h"
#include "data/core/math.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// Whether a map is only shifted, as poses that were given far from their origin are: it keeps the
// axes of a grid that others share.
inline bool IsShiftedOnly(const std::optional<Georeference>& place) {
  return place && place->crs.empty() && place->turn_rad == 0 && place->scale == 1;
}

// "world_offset_m 451200 5411300 312" of a map that is only shifted, else system, origin, turn and
// scale; "" of maps that are in no grid.
inline std::string GeoreferenceNote(const std::optional<Georeference>& place) {
  if (!place) return "";
  const Eigen::Vector3d& p = place->origin_m;
  if (IsShiftedOnly(place)) {
    return fmt::format("world_offset_m {:.0f} {:.0f} {:.0f}", p.x(), p.y(), p.z());
  }
  return fmt::format("{} origin_m {:.4f} {:.4f} {:.4f} turn_deg {:.7f} scale {:.9f}",
                     place->crs.empty() ? "grid" : place->crs, p.x(), p.y(), p.z(),
                     place->turn_rad * kDegreesPerRadian, place->scale);
}

// Where true north is in the map, counterclockwise from its y, or of a grid without a name the
// grid's; nothing of maps that are in none.
inline std::optional<double> FindNorth_rad(const MapSource& source) {
  if (!source.georeference || IsShiftedOnly(source.georeference)) return std::nullopt;
  const Georeference& place = *source.georeference;
  double of_grid_rad = 0;
  if (!place.crs.empty()) {
    const auto on_earth = CoordinateSystem(place.crs).At(place.origin_m);
    if (on_earth) of_grid_rad = on_earth->true_north_rad;
  }
  return of_grid_rad - place.turn_rad;
}

}  // namespace slcmap::exporting
