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
}

}  // namespace slcmap
