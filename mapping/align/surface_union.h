// Points and occupancy of two maps as those of one, what views see of a cloud where their own depth
// is no longer known, and what one rig saw as if another had seen it.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "data/io/trajectory.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline mapping {

// As views are fused to a cloud (mapping/dense/depth_fusion.h), so that a surface that both saw is
// one.
std::vector<DensePoint> UniteSurfaces(const std::vector<DensePoint>& first,
                                      const std::vector<DensePoint>& second, double voxel_m);

struct UnitedPoints {
  std::vector<MapPoint> points;
  std::vector<MapPointObservation> observations;  // of those of either, whose tracks stay apart
};

// One point a voxel, weighted by what is known of each; observations are summed. By voxel.
UnitedPoints UnitePoints(const UnitedPoints& first, const UnitedPoints& second, double voxel_m);

// In the grid of the first. A cell is occupied where a point of the united cloud is, or one of the
// maps says so and the other does not say that it is free; free where one of them says so and
// neither that it is occupied; else unknown. Of two that contradict each other without a point, as
// of what stood there once, it is free. Points stand for patches that are spacing_m wide.
OccupancyMap UniteOccupancy(const OccupancyMap& first, const OccupancyMap& second,
                            const RigidTransform& T_first_second,
                            const std::vector<DensePoint>& united, double spacing_m);

// For each pose of a rectified rig the nearest points of the cloud, one in each cell of the left
// image, that face the camera and that nothing nearer hides, as far as the way to them is known to
// be free: a blank wall has no points, but nothing was measured through it either. Each point is a
// piece of surface of size_m. Throws StoppedError once progress says so.
std::vector<ViewRays> CollectCloudRays(const Trajectory& poses, const Rig& rig,
                                       const std::vector<DensePoint>& cloud, double size_m,
                                       const OccupancyMap& occupancy,
                                       const Progress& progress = {});

// Whether two rigs are one but for what calibrations of it may differ by: centres of cameras within
// 5 mm, their directions within a degree.
bool IsSameRig(const Rig& a, const Rig& b);

// Move pixels from the images of one rig into those of another that is the same. They may then lie
// beyond the border of the image by what the calibrations differ by.
std::vector<LineSupport> SupportsInRig(std::vector<LineSupport> supports, const Rig& from,
                                       const Rig& to);
std::vector<MapPointObservation> ObservationsInRig(std::vector<MapPointObservation> observations,
                                                   const Rig& from, const Rig& to);

}  // namespace slcmap::mapping
