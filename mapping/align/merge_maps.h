// Two maps of one building as one, but for the building, which is made anew of what both measured.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/lines/options.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

inline constexpr const char* kKeyframesOfOtherCameras = "keyframes_of_other_cameras";

// The runs that a map is made of.
std::vector<std::string> CollectRuns(const MapResult& map);

struct MergeOptions {
  double cloud_voxel_m, dense_voxel_m;  // that a point of either cloud stands for
};

struct UnitedMaps {
  MapResult map;  // in the world of the first
  MapAlignment alignment;
  std::vector<ViewRays> rays;        // from the keyframes of both to what was measured
  std::vector<ViewCameras> cameras;  // of the keyframes, by rig
};

// See MergeMaps in mapping/mapping.h. The building, what is filled by it, and the lines of points
// are left to the caller.
UnitedMaps UniteMaps(MapResult first, MapResult second, const AlignmentOptions& alignment,
                     const MergeOptions& options, const Progress& progress = {});

}  // namespace slcmap::mapping
