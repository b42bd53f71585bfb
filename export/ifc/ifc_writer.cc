#include "export/ifc/ifc_writer.h"

#include <spdlog/spdlog.h>

#include "data/file.h"
#include "data/option_table.h"
#include "export/ifc/ifc_lines.h"
#include "export/ifc/ifc_pipes.h"
#include "export/ifc/ifc_rooms.h"
#include "export/ifc/ifc_walls.h"

namespace slcmap {
namespace {

constexpr OptionTable kTable{
    Option{"line_solids", &IfcOptions::line_solids, false, true},
    Option{"line_solid_m", &IfcOptions::line_solid_m, 1e-3, 1.0},
    Option{"slab_m", &IfcOptions::slab_m, 1e-3, 2.0},
    Option{"assumed_height_m", &IfcOptions::assumed_height_m, 0.1, 100.0},
};

}  // namespace

void IfcOptions::Check() const { kTable.Check("ifc", *this); }

std::vector<std::string> IfcWriter::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  options_.Check();
  const std::string path = folder + "/map.ifc";
  IfcFile file;
  IfcStructure structure(map, &file);
  if (!map.source.world_offset_m.isZero()) file.AddMapConversion(map.source.world_offset_m);
  int left_out = AddIfcWalls(map.building, options_, &structure, &file);
  left_out += AddIfcSlabs(map.building, options_, &structure, &file);
  AddIfcSpaces(map.building, &structure, &file);
  left_out += AddIfcPipes(map, &structure, &file);
  progress.ReportOrStop(0.2);
  left_out += AddIfcLines(map, options_, &structure, &file, progress.Part(0.2, 0.9));
  structure.Finish();
  if (left_out > 0) {
    spdlog::warn("map.ifc: {} walls, openings, slabs, pipes or lines without extent are left out",
                 left_out);
  }
  WriteFile(path, file.Text());
  progress.ReportOrStop(1);
  return {path};
}

}  // namespace slcmap
