// slcmap export: a map as files that other programs show.
#include "export/export.h"

#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands.h"
#include "apps/export_options.h"
#include "apps/folder_kind.h"
#include "apps/map_input.h"
#include "apps/progress.h"

namespace slcmap {
namespace {

struct ExportArguments {
  std::string map, output;
  ExportOptions options;
  bool accept_changed = false;
};

void Export(ExportArguments arguments) {
  CheckFormats(arguments.options);
  ExpectFolder(arguments.map, FolderKind::kMap);
  OutputFolder output(arguments.output, ExportFiles(), {arguments.map});
  const MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  output.Open();
  arguments.options.colmap.calibration = arguments.map + "/calibration.yaml";
  const Progress progress = StageProgress("export");
  for (const std::string& path : ExportMap(map, &output, arguments.options, progress)) {
    spdlog::info("wrote {}", path);
  }
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("export", "Write a map as files that other programs show");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("map", arguments->map, "Map folder, as map writes it")
      ->type_name("MAP")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder to write into")
      ->type_name("DIR")
      ->required();
  AddExportOptions(*command, &arguments->options);
  command
      ->add_option("--sequence", arguments->options.colmap.sequence,
                   "Where the recording of --colmap-images is, if not where it was when the map "
                   "was made")
      ->type_name("SEQ")
      ->needs(command->get_option("--colmap-images"));
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as map wrote them, and a map of another run than "
                    "that beside it; values are checked in any case");
  command->footer(
      "Examples:\n  slcmap export OUT/map -o OUT/export\n"
      "  slcmap export OUT/map -o OUT/export --format glb");
  command->callback([arguments] { Export(*arguments); });
}

}  // namespace slcmap
