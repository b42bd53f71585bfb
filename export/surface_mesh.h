// Walls and level surfaces of a building as triangles.
#pragma once

#include "export/plan/wall_solids.h"
#include "export/scene.h"
#include "export/wall_shape.h"
#include "mapping/building/building.h"

namespace slcmap {

// A wall as a closed solid with its openings cut, and its back as it is joined to others, in world;
// its sides have their own vertices and shades of the colour, in place of a light. Nothing of a
// wall that is no solid.
void AddWallMesh(const PlanWall& wall, const WallHeight& height, const Colour& colour,
                 MeshLayer* layer, const WallBack& back = {});

// The front of a plane: its outline, or that of its room, without its openings.
void AddPlaneMesh(const BuildingPlane& plane, const Building& building, const Colour& colour,
                  MeshLayer* layer);

// The outline of a plane that is of one room, as a floor is, which has the room's holes too; else
// that of the plane itself, seen from above.
Polygon LevelOutline(const BuildingPlane& plane, const Building& building);

// The holes of a floor or ceiling, which are those of its room, in world; of other planes none.
std::vector<std::vector<Eigen::Vector3d>> LevelHoles(const BuildingPlane& plane,
                                                     const Building& building);

}  // namespace slcmap
