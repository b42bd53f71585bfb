// Floor plans from files: images, drawings (DXF), IFC, GeoJSON, and maps.
#pragma once

#include <string>
#include <vector>

#include "mapping/map/building.h"
#include "mapping/plan/building_plan.h"

namespace slcmap::inline mapping {

// The storeys of a plan: of an image (dark is wall; its lower left corner is the origin), whose
// pixels are so large; of a DXF file the lines on layers of walls; of an IFC file its walls; of a
// GeoJSON file areas of walls and rooms and lines, in metres; of a map folder the walls that were
// seen. Throws ConfigError where the size of pixels is missing, or said of anything else, and
// DataError, naming the file, what was found, what was expected and what helps, where it holds no
// wall or is not in metres.
std::vector<BuildingPlan> ReadPlans(const std::string& path, double pixel_m);

// As above, of one kind of file each.
std::vector<BuildingPlan> ReadImagePlan(const std::string& path, double pixel_m);
std::vector<BuildingPlan> ReadDxfPlans(const std::string& path);
std::vector<BuildingPlan> ReadIfcPlans(const std::string& path);

// Of maps: the face of a wall's plane, and the openings of a wall.
PlannedFace FaceFrom(const BuildingPlane& plane);
std::vector<PlannedOpening> OpeningsIn(const PlanWall& wall);

}  // namespace slcmap::mapping
