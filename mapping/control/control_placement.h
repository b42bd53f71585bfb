// Where a map lies on control points: a turn about the vertical and a shift, found from pairs of
// points and fitted to all that agree; and how long its metre is by them.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/core/coordinate_system.h"
#include "mapping/control/control_points.h"
#include "mapping/control/triangulation.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// A control point that the map has.
struct ControlMatch {
  std::string name;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  // in the map
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();      // as given
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  // of their difference
};

struct ControlPlacement {
  Georeference place;  // crs and scale are the given ones
  std::vector<bool> fits;
  double scatter = 1;                         // of the residuals, by what is known of them
  double map_scale = 1, map_scale_sigma = 0;  // as ControlFit has them
};

// The place that most points agree on, with metres of the grid to a metre of the map. Throws
// DataError, naming `path`, points, what was found and what helps, where less than two points
// agree, or not more than half of all: told are swapped axes, degrees, another unit, and points
// that are nowhere.
ControlPlacement PlaceOnPoints(const std::string& path, const std::vector<ControlMatch>& matches,
                               double scale);

// How many times longer distances are than a map has them, with its standard deviation.
struct MeasuredScale {
  double times = 1, sigma = 0;
};

// The median of known distances and of those between control points, metres of whose grid are
// `grid_scale` of the ground's, over those of the placed points; nothing where none is in the map.
std::optional<MeasuredScale> MeasureScale(const Control& control,
                                          const std::map<std::string, PlacedPoint>& placed,
                                          double grid_scale);

// The run, so many times larger: what it found, about its left camera, and how far its cameras are
// apart, which is what told it the metre.
void ScaleRun(double times, OdometryRun* run);

}  // namespace slcmap::mapping
