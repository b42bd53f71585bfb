#include "apps/export_options.h"

#include <spdlog/fmt/fmt.h>

namespace slcmap {

void AddExportOptions(CLI::App& command, ExportOptions* options) {
  command
      .add_option("--format", options->formats,
                  fmt::format("Formats, of {} (default: all)", fmt::join(ExportFormats(), ", ")))
      ->delimiter(',');
  command
      .add_option("--max-vertices", options->scene.max_vertices,
                  "Refuse a map that takes more; some 150 bytes of memory each")
      ->capture_default_str();
  command
      .add_option("--plan-scale", options->plan.scale,
                  "Draw plans at 1:N (default: 50 where A2 holds them, else 100 or smaller)")
      ->type_name("N");
  command.add_flag("--wall-sigma", options->plan.wall_sigma,
                   "Write the standard deviation of walls into plans");
  command.add_flag("--plan-mm", options->plan.millimetres,
                   "Write lengths in plans in millimetres, not in metres");
  command
      .add_option("--plan-project", options->plan.project,
                  "Project in the title block of plans (default: the recording's name)")
      ->type_name("TEXT");
  command
      .add_option("--plan-date", options->plan.date,
                  "Date in the title block (default: the day of the recording)")
      ->type_name("TEXT");
  command
      .add_option("--plan-number", options->plan.number,
                  "Number of the drawing, to which the storey's is added (default: of the map's id)")
      ->type_name("TEXT");
  command
      .add_option("--plan-north", options->plan.north_deg,
                  "Where north is by a compass: degrees clockwise from up on the sheet (default: "
                  "not known)")
      ->type_name("DEG");
  command
      .add_option("--section", options->plan.sections,
                  "Draw a section (SVG, PDF, DXF) where the building is cut, in metres of the "
                  "export's frame: x=3.2 or y=1 (x=3.2,back: seen the other way), or from the left "
                  "end to the right one, 1,2:8,2; may be repeated")
      ->type_name("WHERE")
      ->allow_extra_args(false);
  command
      .add_option("--elevations", options->plan.elevations,
                  "Draw elevations: of the building's sides, of the rooms' walls, or of both "
                  "(sides,rooms)")
      ->type_name("LIST")
      ->delimiter(',');
  command.add_flag("--tubes", options->gltf.tubes,
                   "GLB: lines as bars too, for viewers that show only triangles");
  command.add_flag("--voxels", options->gltf.voxels, "GLB: occupied voxels as cubes too");
  command.add_flag("--quantised", options->gltf.quantised,
                   "GLB: positions in 16 bits of each layer's extent, for smaller files");
  command.add_flag("--ascii-ply", options->ply.ascii,
                   "PLY: as text, for scripts that cannot read binary files");
  command.add_option("--obj-up", options->obj.up, "OBJ: the axis that points up, z or y")
      ->capture_default_str()
      ->type_name("AXIS");
  command
      .add_option("--colmap-images", options->colmap.images,
                  "COLMAP: the images too, out of the recording: 'rectified', as its cameras are")
      ->type_name("KIND");
  command
      .add_option_function<std::pair<double, double>>(
          "--grid-heights",
          [options](const std::pair<double, double>& heights_m) {
            options->grid = {heights_m.first, heights_m.second};
          },
          "Grid: metres over a floor between which something is in the way (default: 0.2,1.8)")
      ->delimiter(',')
      ->type_name("LOW,HIGH");
  command.add_flag("--ifc-line-solids", options->ifc.line_solids,
                   "IFC: lines as thin solids too, for viewers that hide annotations");
}

}  // namespace slcmap
