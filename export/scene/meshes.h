// Voxels, lines, pipes, walls and level surfaces as triangles.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "data/core/progress.h"
#include "export/scene/building_solids.h"
#include "export/scene/scene.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// Adds a cube for each voxel, in the colour that colour_of gives, with darker sides in place of a
// light. A face between two voxels of one size is left out. Throws StoppedError when progress says
// so.
void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer,
               const Progress& progress = {});

// The number of vertices that AddVoxels adds.
int64_t CountVoxelVertices(const std::vector<Voxel>& voxels);

// Lines as a mesh.

// Adds a closed bar of square section for each edge, in the colours of its ends. Two faces of a bar
// are upright. Edges without length are left out.
void AddBars(const LineLayer& lines, double width_m, MeshLayer* layer);

// Pipes as things that can be drawn.

inline constexpr Colour kPipeColour{176, 122, 74};

// The axis as a line of kind pipe, with the pipe's id.
MapLine MakeAxisLine(const MapPipe& pipe);

// Adds a closed tube.
void AddTube(const MapPipe& pipe, const Colour& colour, MeshLayer* layer);

// Walls and level surfaces of a building as triangles.

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

}  // namespace slcmap::exporting
