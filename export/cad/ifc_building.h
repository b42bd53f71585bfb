// An IFC building: project, site and storeys; walls with their openings, spaces and slabs.
#pragma once

#include <string>
#include <vector>

#include "export/cad/cad_writers.h"
#include "export/cad/ifc_file.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// A part of the building that elements are put into: a storey, or the building itself for what
// belongs to none.
struct IfcPart {
  std::string entity, placement;
  std::string content;  // tells it from others
  double floor_m = 0;   // its z = 0 in world
  std::vector<std::string> elements, spaces;
};

class IfcStructure {
 public:
  IfcStructure(const MapResult& map, IfcFile* file);

  // Of a storey of the building by its index; of none, the building.
  IfcPart& GetPart(std::optional<std::size_t> storey);

  // Relates what was put into the parts. Call it once, at the end.
  void Finish();

 private:
  void AddStoreys(const MapResult& map);
  void Aggregate(const std::string& whole, const std::string& content,
                 const std::vector<std::string>& parts);

  IfcFile* file_;
  IfcPart building_;
  std::vector<IfcPart> storeys_;
};

// Walls with their openings and doors.

// Adds the walls of a building: each from its storey's floor to the ceiling, behind its measured
// face, with backs that meet those of its neighbours at corners; its openings; and a door or a
// window, without a shape, in each that is one: passages stay open. Returns how many walls without
// length and openings beside their wall were left out.
int AddIfcWalls(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file);

// Rooms as spaces, floors and ceilings as slabs.

// Adds a space for each room, with its area and, where its ceiling was seen, its height and volume;
// rooms without are footprints.
void AddIfcSpaces(const Building& building, IfcStructure* structure, IfcFile* file);

// Adds a slab of assumed thickness under each floor and over each ceiling, with the outline of its
// room, whose holes it has too. Where less than two such thicknesses are between a ceiling and the
// floor above it, both take half of what there is. Returns how many had no area and were left out.
int AddIfcSlabs(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file);

}  // namespace slcmap::exporting
