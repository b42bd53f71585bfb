// What mapping makes of the images of views besides lines: the dense cloud and occupancy.
#pragma once

#include <vector>

#include "data/progress.h"
#include "mapping/building/building_input.h"
#include "mapping/map.h"
#include "mapping/options.h"
#include "mapping/views/view.h"

namespace slcmap {

inline constexpr const char* kDenseViewWithoutImages = "dense_views_without_images";

// Sets the map's dense points, and its occupancy to what confirmed depth shows, and returns what
// each view saw; warnings count views that could not be used. Once progress says so, they are those
// of the views so far. Throws ConfigError when an option is not plausible, or would take too much
// memory.
std::vector<Sights> MapDensely(const Views& views, const ViewImages& images,
                               const MappingOptions& options, const Progress& progress,
                               MapResult* map);

}  // namespace slcmap
