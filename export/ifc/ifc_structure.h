// Project, site, building and storeys, and what each contains.
#pragma once

#include <string>
#include <vector>

#include "export/ifc/ifc_file.h"
#include "mapping/map.h"

namespace slcmap {

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

}  // namespace slcmap
