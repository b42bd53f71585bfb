// Where two planes of a building meet, and what was measured there: edges that images hardly show,
// as those between walls and a ceiling of one paint.
#pragma once

#include <optional>
#include <vector>

#include "data/core/progress.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/surfaces/options.h"

namespace slcmap::inline mapping {

// A plane, and the points of the cloud that are on its surface.
struct SurfacePoints {
  const BuildingPlane* plane = nullptr;
  std::vector<Eigen::Vector3d> points_world;
  Eigen::AlignedBox3d box;  // around them
};

// Of walls, floors and ceilings: the points that face as they do, around their outlines.
std::vector<SurfacePoints> PointsOfPlanes(const Building& building,
                                          const std::vector<DensePoint>& cloud,
                                          const JunctionOptions& options);

// A place of a junction; its bin's middle.
struct JunctionPlace {
  double along_m = 0;                                  // along the direction, from the origin
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  // of either surface, from its plane
};

// The line on which two planes meet; where both surfaces are measured up to it, and look at each
// other, as in the corner of a room.
struct PlaneJunction {
  const BuildingPlane* planes[2] = {nullptr, nullptr};
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();
  std::vector<JunctionPlace> places;  // by along_m, a bin each
  int points = 0;                     // that speak for it

  // Where surfaces that are off their planes by offset_m meet.
  Eigen::Vector3d At(double along_m, const Eigen::Vector2d& offset_m) const;
};

// Nothing where the planes are nearly parallel, or where nothing was measured at both.
std::optional<PlaneJunction> FindJunction(const SurfacePoints& first, const SurfacePoints& second,
                                          const JunctionOptions& options);

// A straight piece of a junction.
struct JunctionEdge {
  const BuildingPlane* planes[2] = {nullptr, nullptr};
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
};

// The edges at which walls, floors and ceilings meet, where none of `lines` is; those with most
// points first, of several that are one edge the first alone. The planes are those of `building`.
// Once progress says so, there are none.
std::vector<JunctionEdge> FindJunctionEdges(const Building& building,
                                            const std::vector<DensePoint>& cloud,
                                            const std::vector<MapLine>& lines,
                                            const JunctionOptions& options,
                                            const Progress& progress = {});

// Adds them to a map's lines, as edges that no image shows (observations 0), of the segment that
// most of its lines are of.
void AddJunctions(const JunctionOptions& options, const Progress& progress, MapResult* map);

// Takes them out again.
void RemoveJunctions(MapResult* map);

}  // namespace slcmap::mapping
