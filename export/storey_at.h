// Which storey of a building something belongs to.
#pragma once

#include <cstddef>
#include <optional>

#include "mapping/building/building.h"

namespace slcmap {

// The index of the storey that a height in world belongs to: the highest whose floor is not above
// it, the lowest for what is beneath all; nothing where the building has no storeys.
std::optional<std::size_t> StoreyAt(const Building& building, double height_m);

// The index of the storey of that id; nothing where there is none.
std::optional<std::size_t> StoreyOfId(const Building& building, int64_t id);

}  // namespace slcmap
