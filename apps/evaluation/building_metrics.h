// Mapped walls, openings, rooms and pipes against true ones: metrics, table and JSON.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/io/map_line.h"
#include "data/io/true_building.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"

namespace slcmap::inline evaluation {

// Figures of nothing, as the median offset of no wall, are kNoFigure.
struct BuildingMetrics {
  // A true wall is found when planes of walls lie over more than half of its points that were seen.
  int64_t walls = 0, walls_found = 0;
  // Between the points of a found wall that were seen, in the mean, and the plane over most of
  // them.
  double offset_median_m = 0, offset_95_m = 0;
  // Errors of the distances between opposite found walls, which face each other or are of one wall.
  int64_t distances = 0;
  double distance_error_95_m = 0;
  // Mapped planes of walls over true ones, and those of them whose 95 % interval, of 1.96 sigma,
  // holds the mean of the true points under them.
  int64_t intervals = 0, intervals_held = 0;
  // Open openings that cameras looked through; right ones overlap by half of the union. One found
  // where there is none, or a closed one, is false.
  int64_t openings = 0, openings_found = 0, openings_false = 0;
  double openings_f1 = 0;
  double clear_width_median_m = 0;  // error
  // Rooms that the camera was in; found ones overlap by half of the union.
  int64_t rooms = 0, rooms_found = 0, rooms_right = 0, rooms_mapped = 0;
  double area_error_median = 0;  // of found ones, as a share
};

// Compares a building with the true one, in one world.
BuildingMetrics EvaluateBuilding(const TrueBuilding& truth, const Building& building);

// The building laid over the truth, as the trajectory was.
Building Aligned(const Alignment& alignment, Building building);

// How what was measured of a mapped building is told.

// Of truth/building.json of a simulated sequence, and planes.json of a map, beside which the other
// files of the building are.

nlohmann::ordered_json BuildingJson(const ComparedFiles& inputs, const BuildingMetrics& metrics);

// How good the pipes of a map are.

struct PipeMetrics {
  int64_t pipes = 0;                    // true ones that were seen so far
  int64_t found = 0;                    // of these
  int64_t found_axes = 0;               // of these, whatever the radius
  int64_t mapped = 0, false_pipes = 0;  // that are no true one, seen or not
  double seen_m = 0, found_m = 0;       // lengths seen, of all and of those that were found
  // Of those that were found; kNoFigure without any.
  double radius_median_m = 0, radius_95_m = 0;
  double axis_median_m = 0;
};

std::vector<MapPipe> Aligned(const Alignment& alignment, std::vector<MapPipe> pipes);

PipeMetrics EvaluatePipes(const std::vector<TruePipe>& truth, const std::vector<MapPipe>& pipes);

// Of truth/pipes.csv of a simulated sequence, and pipes.json of a map.

nlohmann::ordered_json PipeJson(const ComparedFiles& inputs, const PipeMetrics& metrics);

}  // namespace slcmap::evaluation
