// The walls, rooms and pipes of a simulated building, and what the cameras of a rig saw of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/io/map_line.h"
#include "data/io/true_building.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap::inline data {

// A surface this near in front of a point does not hide it.
inline constexpr double kSightMargin_m = 0.02;

// Whether a camera sees a point in its frame that is at most range_m away: a surface less than
// margin_m in front of it does not hide it.
bool IsInSight(const RayScene& rays, const Camera& camera, const RigidTransform& T_world_camera,
               const Eigen::Vector3d& p_camera, double range_m, double margin_m);

// The stretches of a length of which the samples, evenly along it, were seen.
std::vector<Interval> SeenStretches(const std::vector<uint8_t>& seen, double length_m);

// The walls of a scene, nothing seen: planes of least squares where they are bent.
std::vector<TrueWall> TrueWalls(const Scene& scene);

// Its rooms, none entered: the plan's cells between walls, over a slab, one through the door beside
// the other. Walls count that rise above 1.2 m over the slab.
std::vector<TrueRoom> TrueRooms(const Scene& scene);

// Both, with the points that were seen, and the rooms that one of the places is in.
TrueBuilding ObserveBuilding(const Scene& scene,
                             const std::function<bool(const Eigen::Vector3d&)>& is_seen,
                             const std::vector<Eigen::Vector3d>& places);

// Both, with what was seen from the first `frames` of the task, twice a second. Once the task's
// stop is requested, with what was seen until then.
TrueBuilding ObserveBuilding(const Scene& scene, const RayScene& rays, const RenderTask& task,
                             int frames);

// The pipes of a scene, numbered in its order, with what was seen of them from the first `frames`
// of the task, twice a second: where the middle of a pipe, as a camera sees it, is in the image and
// not hidden. Once the task's stop is requested, with what was seen until then.
std::vector<TruePipe> ObservePipes(const Scene& scene, const RayScene& rays, const RenderTask& task,
                                   int frames);

// control.csv: the middles of the scene's tags, exact, as a surveyor gives them: in its
// georeference, or in the world where it has none.
void WriteTrueControl(const std::string& path, const Scene& scene);

}  // namespace slcmap::data
