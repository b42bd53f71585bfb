// Two maps of one building as one, but for the building, which is made anew of what both measured.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/lines/options.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/names.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

inline constexpr const char* kKeyframesOfOtherCameras = "keyframes_of_other_cameras";

// The runs that a map is made of: those of a merged map, or its own.
std::vector<MergedRun> SplitIntoParts(const MapResult& map);
std::vector<std::string> CollectRuns(const MapResult& map);

// Throws DataError where a run is in both, by its name.
void RequireDifferentRuns(const MapResult& first, const MapResult& second);

struct MergeOptions {
  double cloud_voxel_m, dense_voxel_m;  // that a point of either cloud stands for
};

// Throws DataError for a map that cannot be merged: made without images, or of a run that was lost
// in between.
void RequireMergeable(const MapResult& map);

// Poses of a rig, in the world of the map that they look at.
struct RigPoses {
  Trajectory poses;
  Rig rig;
};

// Maps that became one; its building is not made yet.
struct UnitedMaps {
  MapResult map;
  std::vector<RigPoses> watchers;  // all keyframes, also those whose images the map does not show
  Names names;                     // of its buildings so far, in its world
};

// Takes what is derived out of a map that is to be united with others. Throws what RequireMergeable
// throws.
UnitedMaps PrepareToUnite(MapResult map);

// The second in the world of the first. See MergeMaps in mapping/mapping.h. The building, what is
// filled by it, and the lines of points are left to the caller. Throws DataError where a run is in
// both, and StoppedError once progress says so.
UnitedMaps UniteMaps(UnitedMaps first, UnitedMaps second, const RigidTransform& T_first_second,
                     const MergeOptions& options, const Progress& progress = {});

// From the keyframes to what was measured.
std::vector<ViewRays> CollectViewRays(const UnitedMaps& united, double voxel_m,
                                      const Progress& progress = {});
std::vector<ViewCameras> MakeViewCameras(const UnitedMaps& united);

}  // namespace slcmap::mapping
