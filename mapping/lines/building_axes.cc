#include "mapping/lines/building_axes.h"

#include <algorithm>

#include "odometry/geometry/slope.h"
#include "odometry/geometry/structural_line.h"

namespace slcmap {

std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad) {
  const double sigma_rad = std::max(run.line_deviation_rad, min_sigma_rad);
  std::vector<BuildingAxis> axes = {
      {LineAxis::kVertical, -1, -1, AxisDirection(LineAxis::kVertical, 0), sigma_rad}};
  for (size_t i = 0; i < run.manhattan_worlds.size(); ++i) {
    const ManhattanWorld& world = run.manhattan_worlds[i];
    if (world.withdrawn) continue;
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back({axis, static_cast<int>(i), world.segment,
                      AxisDirection(axis, world.heading_rad), sigma_rad});
    }
  }
  for (size_t i = 0; i < run.sloped_directions.size(); ++i) {
    const SlopedDirection& slope = run.sloped_directions[i];
    if (slope.withdrawn) continue;
    axes.push_back({LineAxis::kSloped, static_cast<int>(i), slope.segment,
                    SlopeDirection(SlopeBlock{slope.azimuth_rad, slope.elevation_rad}.data()), sigma_rad});
  }
  return axes;
}

}  // namespace slcmap
