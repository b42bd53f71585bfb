// Time and memory of the export of a made map in all formats, or in some.
//
//   export_speed FOLDER [--lines N] [--points N] [--planes N] [--format LIST]
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "export/export.h"
#include "tests/export/web/room_map.h"

namespace slcmap {
namespace {

struct Arguments {
  std::string folder;
  testing::RoomMapSize size = {100000, 1000000, 500};
  ExportOptions options;
};

double PeakMemory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void Run(const Arguments& arguments) {
  const MapResult map = testing::MakeRoomMap(arguments.size);
  const double of_map_mib = PeakMemory_mib();
  const std::vector<std::string> formats =
      arguments.options.formats.empty() ? ExportFormats() : arguments.options.formats;
  ExportOptions options = arguments.options;
  double all_s = 0;
  for (const std::string& format : formats) {
    options.formats = {format};
    const auto begin = std::chrono::steady_clock::now();
    ExportMap(map, arguments.folder, options);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    all_s += wall.count();
    std::printf("%-8s %6.2f s, %7.0f MiB at most so far\n", format.c_str(), wall.count(),
                PeakMemory_mib());
  }
  std::printf("all      %6.2f s; the map alone %.0f MiB\n", all_s, of_map_mib);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  slcmap::Arguments arguments;
  CLI::App app("Time and memory of exports");
  app.add_option("folder", arguments.folder)->required();
  app.add_option("--lines", arguments.size.lines);
  app.add_option("--points", arguments.size.dense_points);
  app.add_option("--planes", arguments.size.planes);
  app.add_option("--format", arguments.options.formats)->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  slcmap::Run(arguments);
  return 0;
}
