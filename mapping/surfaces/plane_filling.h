// Surfaces that stereo does not measure everywhere, as blank walls, floors and ceilings, also
// beyond rooms, filled where the building's planes and what was measured around agree.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "data/io/map_line.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/options.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// At the heights of each storey's floor and ceiling, where rays went between these and no room of
// it is near: rooms whose walls were not all seen are none, but their floors are looked at all the
// same. Throws StoppedError once progress says so. Their height is not known better than a
// storey's, so they hold only what is measured around.
std::vector<BoundedPlane> StoreyPlanes(const Building& building, const std::vector<ViewRays>& rays,
                                       const PlaneOptions& options, const Progress& progress = {});

// What is known of a building before.
struct MeasuredBuilding {
  const std::vector<DensePoint>& dense;
  const std::vector<MapLine>& lines;
  const Building& building;
  const std::vector<ViewRays>& rays;  // rays to what was measured
  std::vector<ViewCameras> watchers;  // views that look at it, by rig
  double voxel_m;                     // that a point of the cloud stands for
};

// Points, a cell of walls, floors and ceilings each: where nothing was
// measured, the points around are on one surface or the plane itself is well known, of a wall no
// line parts it from what is around, a camera looks there past all that was measured or is filled,
// and no ray goes through. Inferred walls are not filled. Beyond rooms, floors and ceilings are
// filled at the heights of their storey (see StoreyPlanes). The same with any number of threads.
// Once progress says so, there are none.
std::vector<DensePoint> FillPlanes(const MeasuredBuilding& measured, const PlaneOptions& options,
                                   const Progress& progress = {});

}  // namespace slcmap::mapping
