#include "mapping/line_map.h"

#include "odometry/run_lines.h"

namespace slcmap {

std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options) {
  std::vector<MapLine> selected;
  for (const MapLine& line : MapLines(run)) {
    // Comparisons with a value that is not finite fail.
    const bool has_extent = (line.end_world - line.start_world).squaredNorm() > 0;
    if (has_extent && line.sigma_m <= options.max_sigma_m &&
        line.observations >= options.min_observations) {
      selected.push_back(line);
    }
  }
  return selected;
}

}  // namespace slcmap
