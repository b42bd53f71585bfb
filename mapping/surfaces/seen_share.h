// Which share of the surfaces that the cameras saw a map holds, as far as the map itself can tell:
// in all, by room and by wall.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/surfaces/options.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// The views of a map, by rig, and rays to what they measured.
struct SeenFrom {
  const std::vector<ViewCameras>& watchers;
  const std::vector<ViewRays>& rays;
};

// Looks along rays from the left images of some views, as far as 8 m. Where a ray meets the front
// of a point, measured or filled, that place is held. Where it meets a plane of the building that
// no measured ray goes through, the back of something, or nothing although its neighbours do, a
// surface was seen there that the map lacks. Rays through windows that meet nothing tell nothing.
// Each voxel counts once, however often it was seen. Sets MapResult::seen_share and those of rooms
// and walls of which enough was seen. Deterministic. Once progress says so, there are none.
void MeasureSeenShare(const SeenFrom& seen, const PlaneOptions& options, const Progress& progress,
                      MapResult* map);

// A map that lacks much is doubtful, and its verdict names the rooms that lack most. What the
// verdict said of that before is taken out.
void JudgeSeenShare(MapResult* map);

inline constexpr const char* kSeenShareReason = "seen-share";

}  // namespace slcmap::mapping
