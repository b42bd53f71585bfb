// Two maps of one building as one.
#pragma once

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/map.h"
#include "mapping/options.h"

namespace slcmap::inline mapping {

inline constexpr const char* kKeyframesOfOtherCameras = "keyframes_of_other_cameras";

struct MergedMaps {
  MapResult map;
  MapAlignment alignment;
};

// Throws DataError, naming the run, where one run is in both maps.
void RefuseSameRuns(const std::vector<std::string>& runs, const MapResult& map);

// The runs that a map is made of.
std::vector<std::string> CollectRuns(const MapResult& map);

// The second is brought into the world of the first, where both are united as README.md, "Merging
// maps", describes. Deterministic. Throws AlignmentError where it is not known how they belong
// together, DataError for maps that cannot be merged (made without images, of a run that was lost
// in between, of one run), and StoppedError once progress says so.
MergedMaps MergeMaps(MapResult first, MapResult second, const AlignmentOptions& alignment,
                     const MappingOptions& options, const Progress& progress = {});

}  // namespace slcmap::mapping
