// slcmap export: a map as files that other programs show.
#include "export/export.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands.h"
#include "mapping/map_folder.h"

namespace slcmap {
namespace {

struct ExportArguments {
  std::string map, output;
  ExportOptions options;
};

void Export(const ExportArguments& arguments) {
  CheckFormats(arguments.options);
  OutputFolder output(arguments.output, ExportFiles(), {arguments.map});
  const MapResult map = ReadMapFolder(arguments.map);
  if (!map.complete) spdlog::warn("{}: the map is partial: {}", arguments.map, map.partial_reason);
  for (const std::string& path : ExportMap(map, &output, arguments.options)) {
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
  command
      ->add_option("--format", arguments->options.formats,
                   fmt::format("Formats, of {} (default: all)", fmt::join(ExportFormats(), ", ")))
      ->delimiter(',');
  command->footer(
      "Examples:\n  slcmap export OUT/map -o OUT/export\n"
      "  slcmap export OUT/map -o OUT/export --format glb");
  command->callback([arguments] { Export(*arguments); });
}

}  // namespace slcmap
