// slcmap export: a map as files that other programs show.
#include "export/export.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>

#include "apps/commands.h"
#include "apps/export_options.h"
#include "apps/folder_kind.h"
#include "apps/progress.h"
#include "data/error.h"
#include "mapping/map_folder.h"
#include "odometry/run_folder.h"

namespace slcmap {
namespace {

struct ExportArguments {
  std::string map, output;
  ExportOptions options;
  bool accept_changed = false;
};

// As `slcmap run` lays folders out, the run of a map is beside it.
void RefuseOutdated(const std::string& folder, const MapResult& map) {
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder + "/.");
  const std::filesystem::path self = path.has_filename() ? path : path.parent_path();
  if (self.filename() != "map") return;  // not laid out as `run` does it
  const std::string run = self.parent_path() / "run";
  const std::string found = RunIdIn(run);
  if (found.empty() || found == map.source.run_id) return;
  throw DataError(
      fmt::format("{}: found a map of run {}, expected one of run {}, which is in {}: map that run "
                  "first, or take the map as it is with --accept-changed",
                  folder, map.source.run_id, found, run));
}

MapResult ReadMap(const std::string& folder, bool accept_changed) {
  const EndsAtOnce nothing_is_written;
  MapResult map = ReadMapFolder(folder, {.accept_changed = accept_changed});
  if (!accept_changed) RefuseOutdated(folder, map);
  return map;
}

void Export(const ExportArguments& arguments) {
  CheckFormats(arguments.options);
  ExpectFolder(arguments.map, FolderKind::kMap);
  OutputFolder output(arguments.output, ExportFiles(), {arguments.map});
  const MapResult map = ReadMap(arguments.map, arguments.accept_changed);
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
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as map wrote them, and a map of another run than "
                    "that beside it; values are checked in any case");
  command->footer(
      "Examples:\n  slcmap export OUT/map -o OUT/export\n"
      "  slcmap export OUT/map -o OUT/export --format glb");
  command->callback([arguments] { Export(*arguments); });
}

}  // namespace slcmap
