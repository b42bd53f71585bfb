// From the keyframes and landmarks of a run, and the images of its views, to a map of the building.
#pragma once

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/map.h"
#include "mapping/map/stage_store.h"
#include "mapping/options.h"
#include "mapping/views/recorded_views.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// Builds the map of a run; of a run without landmarks and views, an empty one. With views, the
// lines are those of their images, else those of the run. The same input gives the same map, to the
// last bit. Once progress says so, the map is what is done so far, and not complete. Of views, long
// stages are taken from the store where it has them, and put there once they are done. Throws
// ConfigError when an option is not plausible, or would take too much memory.
MapResult BuildMap(const OdometryRun& run, const RecordedViews* recorded,
                   const MappingOptions& options, const StageStore& store,
                   const Progress& progress = {});

// With nothing kept.
inline MapResult BuildMap(const OdometryRun& run, const RecordedViews* recorded,
                          const MappingOptions& options, const Progress& progress = {}) {
  return BuildMap(run, recorded, options, StageStore(), progress);
}

// From the run alone.
inline MapResult BuildMap(const OdometryRun& run, const MappingOptions& options,
                          const Progress& progress = {}) {
  return BuildMap(run, nullptr, options, progress);
}

struct MergedMaps {
  MapResult map;
  MapAlignment alignment;
};

// The second is brought into the world of the first, where both are united as README.md, "Merging
// maps", describes, and their building is made anew. Deterministic. Throws AlignmentError where it
// is not known how they belong together, DataError for maps that cannot be merged (made without
// images, of a run that was lost in between, of one run), and StoppedError once progress says so.
MergedMaps MergeMaps(MapResult first, MapResult second, const AlignmentOptions& alignment,
                     const MappingOptions& options, const Progress& progress = {});

}  // namespace slcmap::mapping
