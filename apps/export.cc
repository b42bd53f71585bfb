// slcmap export: a map as files that other programs show.
#include "export/export.h"

#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands.h"
#include "apps/export_options.h"
#include "apps/folder_kind.h"
#include "apps/progress.h"
#include "mapping/map_folder.h"

namespace slcmap {
namespace {

struct ExportArguments {
  std::string map, output;
  ExportOptions options;
};

MapResult ReadMap(const std::string& folder) {
  const EndsAtOnce nothing_is_written;
  return ReadMapFolder(folder);
}

void Export(const ExportArguments& arguments) {
  CheckFormats(arguments.options);
  ExpectFolder(arguments.map, FolderKind::kMap);
  OutputFolder output(arguments.output, ExportFiles(), {arguments.map});
  const MapResult map = ReadMap(arguments.map);
  if (!map.complete) spdlog::warn("{}: the map is partial: {}", arguments.map, map.partial_reason);
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
  command->footer(
      "Examples:\n  slcmap export OUT/map -o OUT/export\n"
      "  slcmap export OUT/map -o OUT/export --format glb");
  command->callback([arguments] { Export(*arguments); });
}

}  // namespace slcmap
