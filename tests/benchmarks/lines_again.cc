// Makes the lines of a map anew, with the dense cloud that it has: in half the time of a map, for
// work on lines. Junctions are those of the map; pipes are not looked for.
//
//   lines_again RUN MAP OUTPUT [CONFIG]    OUTPUT as line_recall takes it
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "data/core/error.h"
#include "data/io/map_line.h"
#include "mapping/adjustment/adjustment.h"
#include "mapping/lines/map_lines.h"
#include "mapping/map/part_files.h"
#include "mapping/map/refinement.h"
#include "mapping/options.h"
#include "mapping/views/recorded_views.h"
#include "mapping/views/views_between.h"
#include "odometry/run/run_folder.h"

namespace slcmap {
namespace {

void Make(const std::string& run_folder, const std::string& map, const std::string& output,
          const MappingOptions& options) {
  const OdometryRun online = ReadRunFolder(run_folder);
  OdometryRun run = AdjustRun(online, options.adjustment, KeyframeImages(online, {}).get()).run;
  TurnAlongBuilding(&run);
  const RecordedViews recorded = ViewsOfRun(run, {});
  const RecordedViews chosen = ViewsForLines(recorded, options.lines.views);
  std::vector<DensePoint> dense = ReadDensePly(map + "/dense.ply");
  std::erase_if(dense, [](const DensePoint& p) { return p.source != DenseSource::kStereo; });
  const auto axes = AxesOfRun(run, options.lines.min_axis_sigma_rad);
  const VisibilityDepths depths(dense, options.dense.voxel_m,
                                ViewCameras(chosen.views, chosen.images->rig()), {});
  std::vector<MapLine> all = BuildLines(chosen.views, *chosen.images, axes,
                                        KnownLines(run, axes, options.run_lines.max_sigma_m,
                                                   options.run_lines.min_observations),
                                        depths, LineSurfaces(dense), options.lines)
                                 .lines;
  for (const MapLine& line : ReadMapLines(map + "/lines.ply")) {
    if (line.observations == 0) all.push_back(line);
  }
  std::filesystem::create_directories(output);
  WriteMapLines(output + "/marks.ply", TakeMarks(&all));
  WriteMapLines(output + "/lines.ply", all);
  std::filesystem::copy_file(map + "/trajectory.tum", output + "/trajectory.tum",
                             std::filesystem::copy_options::overwrite_existing);
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::cerr << "usage: lines_again RUN MAP OUTPUT [CONFIG]\n";
    return 2;
  }
  try {
    slcmap::Make(argv[1], argv[2], argv[3],
                 argc > 4 ? slcmap::MappingOptions::FromYaml(argv[4]) : slcmap::MappingOptions());
  } catch (const slcmap::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
