// Marks on floors and ceilings: joints, stripes, prints and shadows that looked like edges while
// only the surfaces around a line were asked.
#pragma once

#include <vector>

#include "mapping/level_marks/level_mark_options.h"
#include "mapping/map.h"
#include "mapping/options.h"

namespace slcmap {

// Lines that run flat on a floor or a ceiling that goes on at both of their sides, where
// hardly anything stands on it or hangs from it, become marks; those of unknown kind on floors
// only. On a surface that is whole, points of the cloud are at most cell_m apart.
void TellLevelMarks(const Building& building, const std::vector<DensePoint>& cloud, double cell_m,
                    const LevelMarkOptions& options, std::vector<MapLine>* lines);

// The same for a map whose planes are filled; they join its marks.
void MoveLevelMarks(const MappingOptions& options, MapResult* map);

}  // namespace slcmap
