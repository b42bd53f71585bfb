// slcmap export: a map as files that other programs show.
// slcmap view: a map as one HTML file for a browser.
#include "apps/commands/export.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>

#include "apps/commands/commands.h"
#include "apps/commands/file_server.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/output_folder.h"
#include "data/source/recorded_source.h"
#include "export/export.h"

namespace slcmap::inline commands {
namespace {

struct ExportArguments {
  std::string map, output;
  ExportOptions options;
  std::string names;
  bool accept_changed = false;
};

void Export(ExportArguments arguments) {
  CheckFormats(arguments.options);
  ExpectFolder(arguments.map, FolderKind::kMap);
  const NamesFile names(arguments.names);
  std::vector<std::string> inputs = {arguments.map};
  if (!arguments.names.empty()) inputs.push_back(arguments.names);
  OutputFolder output(arguments.output, ExportFiles(), inputs);
  MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  names.Apply(&map);
  output.Open();
  arguments.options.recording.calibration = arguments.map + "/calibration.yaml";
  arguments.options.tiles_page = FindTilesPage();
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
  AddNamesOption(*command, &arguments->names);
  command
      ->add_option("--sequence", arguments->options.recording.sequence,
                   "Where the recording of --format ortho and --colmap-images is, if not where it "
                   "was when the map was made")
      ->type_name("SEQ");
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as map wrote them, and a map of another run than "
                    "that beside it; values are checked in any case");
  command->footer(
      "Examples:\n  slcmap export OUT/map -o OUT/export\n"
      "  slcmap export OUT/map -o OUT/export --format glb");
  command->callback([arguments] { Export(*arguments); });
}

void AddExportOptions(CLI::App& command, ExportOptions* options) {
  command
      .add_option("--format", options->formats,
                  fmt::format("Formats, of {} (default: all but ortho, which needs the recording)",
                              fmt::join(ExportFormats(), ", ")))
      ->delimiter(',');
  command
      .add_option("--max-vertices", options->max_vertices,
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
      .add_option(
          "--plan-number", options->plan.number,
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
  command.add_flag("--ascii-ply", options->ascii_ply,
                   "PLY: as text, for scripts that cannot read binary files");
  command.add_option("--obj-up", options->obj_up, "OBJ: the axis that points up, z or y")
      ->capture_default_str()
      ->type_name("AXIS");
  command
      .add_option("--colmap-images", options->colmap_images,
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
  command
      .add_option("--las-version", options->las_version,
                  "LAS: 1.2, which most programs read, or 1.4")
      ->capture_default_str()
      ->type_name("VERSION");
  command.add_flag("--ifc-line-solids", options->ifc_line_solids,
                   "IFC: lines as thin solids too, for viewers that hide annotations");
}

namespace {

constexpr char kTilesPage[] = "page/tiles.html";

struct ViewArguments {
  std::string map, output;
  std::string served;  // folder of tilesets; "" where a page is written
  int port = 8080;     // as many servers for oneself have it
  std::string title;
  bool accept_changed = false;
  bool images = false;
  std::string names;
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
  if (path.empty() || !Exists(path)) {
    throw DataError(fmt::format(
        "{}: --images: found no recording {}, expected the one that the map was made of "
        "(--sequence names where it moved to)",
        arguments.map, path.empty() ? "named by the map" : path));
  }
  RefuseInputs(LinkTarget(arguments.output), {path});
  return OpenAgain(path, map.source.opened, arguments.map + "/calibration.yaml", false);
}

// The tilesets in a folder, as seen from it: its own, or those of the folders below.
std::vector<std::string> FindTilesets(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> found;
  std::error_code error;
  if (fs::exists(folder + "/tileset.json", error)) return {"tileset.json"};
  auto it = fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied,
                                             error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (!fs::exists(it->path() / "tileset.json", error)) continue;
    it.disable_recursion_pending();  // what is below is a part of it
    found.push_back((it->path().lexically_relative(folder) / "tileset.json").string());
  }
  std::sort(found.begin(), found.end());
  if (!found.empty()) return found;
  throw DataError(folder +
                  ": found no tileset.json in it or below, expected a folder that `slcmap export "
                  "--format tiles` wrote");
}

void ServeTiles(const std::string& folder, int port) {
  const std::vector<std::string> tilesets = FindTilesets(folder);
  const std::string page = MakeTilesPage(ReadPageTemplate(kTilesPage), tilesets);
  FileServer server(folder, port, {{"/", page}});
  spdlog::info("serving {} of {}: open http://127.0.0.1:{}/ on this computer; Ctrl-C ends",
               tilesets.size() == 1 ? "the tileset" : fmt::format("{} tilesets", tilesets.size()),
               folder, server.port());
  server.Run([] { return Interrupted(); });
}

// Either a map into a file, or a folder over HTTP.
void CheckWhatIsViewed(const ViewArguments& arguments) {
  if (!arguments.served.empty() || (!arguments.map.empty() && !arguments.output.empty())) return;
  throw ConfigError(fmt::format("{}: missing, expected a map and -o FILE, or --serve FOLDER",
                                arguments.map.empty() ? "MAP" : "--output"));
}

void ViewMap(ViewArguments arguments) {
  CheckWhatIsViewed(arguments);
  if (!arguments.served.empty()) return ServeTiles(arguments.served, arguments.port);
  ExpectFolder(arguments.map, FolderKind::kMap);
  CheckOutput(arguments.output, arguments.map);
  const std::string page_template = ReadPageTemplate();
  const NamesFile names(arguments.names);
  MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  names.Apply(&map);
  if (arguments.title.empty()) arguments.title = TitleOfMap(arguments.map);
  const MadeFolder folder(std::filesystem::absolute(LinkTarget(arguments.output)).parent_path());
  const Progress progress = StageProgress("view");
  std::vector<PageImage> images;
  if (arguments.images) {
    images = ReadPageImages(map, *OpenRecording(map, arguments), {}, progress.Part(0, 0.5));
  }
  WritePage(map, page_template, arguments.title, images, arguments.output,
            progress.Part(arguments.images ? 0.5 : 0, 1));
}

}  // namespace

void AddViewCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("view", "Write a map as a page that a browser shows, offline");
  const auto arguments = std::make_shared<ViewArguments>();
  CLI::Option* map =
      command->add_option("map", arguments->map, "Map folder, as map writes it")->type_name("MAP");
  CLI::Option* output = command->add_option("-o,--output", arguments->output, "HTML file to write")
                            ->type_name("FILE");
  CLI::Option* serve =
      command
          ->add_option("--serve", arguments->served,
                       "Instead show the tilesets of a folder, which export --format tiles writes, "
                       "to browsers on this computer")
          ->type_name("FOLDER")
          ->excludes(map)
          ->excludes(output);
  command->add_option("--port", arguments->port, "Of the server; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str()
      ->needs(serve);
  command->add_option("--title", arguments->title, "Of the page (default: the folder's name)");
  AddNamesOption(*command, &arguments->names);
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
      "  slcmap view OUT/map -o OUT/map.html --images\n"
      "  slcmap view --serve OUT/export/tiles");
  command->callback([arguments] { ViewMap(*arguments); });
}

namespace {

// What all pages of maps hold before the map, so that a page is known whatever else it shows.
constexpr std::string_view kPageBegin = "<!doctype html>", kPageTitle = "<title>slcmap</title>",
                           kPageMap = "<script id=\"map\" type=\"text/plain\">";
constexpr std::streamsize kBytesBeforeMap = 1 << 17;  // about ten times as many as there are

// A page of a map, as slcmap writes it.
bool IsPage(const std::string& path) {
  std::string text(kBytesBeforeMap, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), kBytesBeforeMap);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text.starts_with(kPageBegin) && text.find(kPageTitle) != text.npos &&
         text.find(kPageMap) != text.npos;
}

}  // namespace

std::string TitleOfMap(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder + "/.");
  const std::filesystem::path self = path.has_filename() ? path : path.parent_path();
  const bool has_name = self.filename() != "map" || !self.parent_path().has_filename();
  return (has_name ? self : self.parent_path()).filename().string();
}

void CheckPagePlace(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw ConfigError(fmt::format("output {}: found a folder, expected a file's name, such as {}",
                                  path, (std::filesystem::path(path) / "map.html").string()));
  }
  if (const std::string found = NoFileAt(path); !found.empty()) {
    throw ConfigError(fmt::format("output {}: found {}, expected a file", path, found));
  }
  if (!std::filesystem::exists(path, error) || IsPage(path)) return;
  throw ConfigError(fmt::format(
      "output {}: found a file that is no page of a map by slcmap, expected a new name: it would "
      "be overwritten",
      path));
}

void RemovePage(const std::string& path) {
  std::error_code ignored;
  if (IsPage(path)) std::filesystem::remove(LinkTarget(path), ignored);
}

void WritePage(const MapResult& map, const std::string& page_template, const std::string& title,
               const std::vector<PageImage>& images, const std::string& path,
               const Progress& progress) {
  const std::string page = MakePage(map, page_template, title, images, progress);
  CheckPagePlace(path);  // again: that took a while
  ReplaceFile(path, page);
  spdlog::info("wrote {} ({:.1f} MB): open it in a browser", path,
               static_cast<double>(page.size()) * 1e-6);
}

std::string ReadPageTemplate(const std::string& name) {
  const std::string path = FindSharedFile(name);
  if (!path.empty()) return ReadFile(path);
  throw DataError(fmt::format(
      "share/slcmap/{}: found no page above the program, expected the one that is made with it: "
      "build it again where npm is installed and can fetch packages",
      name));
}

std::string FindTilesPage() {
  const std::string path = FindSharedFile(kTilesPage);
  return path.empty() ? "" : ReadFile(path);
}

}  // namespace slcmap::commands
