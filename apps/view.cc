// slcmap view: a map as one HTML file for a browser.
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <memory>

#include "apps/commands.h"
#include "apps/folder_kind.h"
#include "apps/map_input.h"
#include "apps/page_file.h"
#include "apps/page_template.h"
#include "apps/progress.h"
#include "data/error.h"
#include "data/file.h"
#include "data/made_folder.h"
#include "data/output_folder.h"
#include "data/source/asl_source.h"

namespace slcmap {
namespace {

struct ViewArguments {
  std::string map, output;
  PageOptions page;
  bool accept_changed = false;
  bool images = false;
  std::string sequence;  // where the recording moved to; "" where the map says it is
};

// Before the work that it would be in vain.
void CheckOutput(const std::string& path, const std::string& map) {
  RefuseInputs(LinkTarget(path), {map});
  CheckPagePlace(path);
  if (std::filesystem::path(path).has_filename()) return;
  throw ConfigError(fmt::format(
      "output {}: found a folder's name, expected a file's, such as {}map.html", path, path));
}

// With the calibration that the map was made with, where it says that.
std::unique_ptr<SequenceSource> OpenRecording(const MapResult& map,
                                              const ViewArguments& arguments) {
  const std::string& path = arguments.sequence.empty() ? map.source.sequence : arguments.sequence;
  std::error_code error;
  if (path.empty() || !std::filesystem::exists(path, error)) {
    throw DataError(fmt::format(
        "{}: --images: found no recording {}, expected the one that the map was made of "
        "(--sequence names where it moved to)",
        arguments.map, path.empty() ? "named by the map" : path));
  }
  RefuseInputs(LinkTarget(arguments.output), {path});
  return OpenAgain(path, map.source.opened, arguments.map + "/calibration.yaml", false);
}

void ViewMap(ViewArguments arguments) {
  ExpectFolder(arguments.map, FolderKind::kMap);
  CheckOutput(arguments.output, arguments.map);
  const std::string page_template = ReadPageTemplate();
  const MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  if (arguments.page.title.empty()) arguments.page.title = TitleOfMap(arguments.map);
  const MadeFolder folder(std::filesystem::absolute(LinkTarget(arguments.output)).parent_path());
  const Progress progress = StageProgress("view");
  std::vector<PageImage> images;
  if (arguments.images) {
    images = ReadPageImages(map, *OpenRecording(map, arguments), {}, progress.Part(0, 0.5));
  }
  WritePage(map, page_template, arguments.page, images, arguments.output,
            progress.Part(arguments.images ? 0.5 : 0, 1));
}

}  // namespace

void AddViewCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("view", "Write a map as a page that a browser shows, offline");
  const auto arguments = std::make_shared<ViewArguments>();
  command->add_option("map", arguments->map, "Map folder, as map writes it")
      ->type_name("MAP")
      ->required();
  command->add_option("-o,--output", arguments->output, "HTML file to write")
      ->type_name("FILE")
      ->required();
  command->add_option("--title", arguments->page.title, "Of the page (default: the folder's name)");
  CLI::Option* images =
      command->add_flag("--images", arguments->images,
                        "Also pictures of keyframes, at most 200 of them, from the recording");
  command
      ->add_option("--sequence", arguments->sequence,
                   "Where the recording is, if not where it was when the map was made")
      ->type_name("SEQ")
      ->needs(images);
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as map wrote them, and a map of another run than "
                    "that beside it; values are checked in any case");
  command->footer(
      "Examples:\n  slcmap view OUT/map -o OUT/map.html\n"
      "  slcmap view OUT/map -o OUT/map.html --images");
  command->callback([arguments] { ViewMap(*arguments); });
}

}  // namespace slcmap
