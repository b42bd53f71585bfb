// Maps against the truth: lines, surfaces, buildings and pipes; metrics, and these as JSON.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "data/core/progress.h"
#include "data/io/map_line.h"
#include "data/io/true_building.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline evaluation {

inline constexpr std::array kLineTolerances_m = {0.01, 0.02, 0.05, 0.1, 0.2};
inline constexpr int kMostLineSamples = 10000000;  // of lines and edges together, 2 cm each

// What is right up to a tolerance. A mapped sample is correct when a true edge (one that was seen,
// over its whole length) of nearly its direction is within the tolerance; a sample of the seen
// parts is covered when a mapped line of nearly its direction is. Shares of nothing are kNoFigure.
struct LineScore {
  double tolerance_m = 0;
  double recall_m = 0;                 // covered length of the seen parts
  double recall = 0;                   // as a share of their length
  std::optional<double> clear_recall;  // share of the clearly seen length that is covered
  double correct_m = 0;                // correct length of the mapped lines
  double precision = 0;                // as a share of their length
  double redundancy = 0;               // mapped length over covered length, 1 is ideal
};

// Over the mapped samples that are correct at the largest tolerance, each compared with the nearest
// true edge of nearly its direction; where that is bent, directions with that of its part beside
// the line.
struct LineAccuracy {
  double length_m = 0;  // of those samples
  double direction_mean_deg = 0;
  double direction_rms_deg = 0;
  double offset_rms_m = 0;  // distance to the edge
};

// Of lines whose kind was told: what was called which by length, at the tolerance of a score. A
// line is an edge's where a sample of it is correct. Shares of nothing are kNoFigure.
struct KindScore {
  double tolerance_m = 0;
  double marks_called_edges = 0;  // share of what is no edge's
  double edges_called_marks = 0;  // share of what is an edge's
};

struct LineMetrics {
  int64_t lines = 0;           // mapped
  int64_t without_extent = 0;  // of them; they count for nothing
  double mapped_length_m = 0;
  double seen_length_m = 0;              // of the true edges
  std::optional<double> clear_length_m;  // of their parts that were seen well, where known
  std::vector<LineScore> scores;         // by tolerance
  std::optional<LineAccuracy> accuracy;  // nothing where no sample is correct
  double marks_length_m = 0;
  std::vector<KindScore> kinds;  // by tolerance; none of a map without marks
};

// Compares lines with edges in the same world. Throws DataError when their lengths take more than
// max_samples, and StoppedError when progress says so.
LineMetrics EvaluateLines(const TrueEdges& truth, const std::vector<MapLine>& lines,
                          int max_samples = kMostLineSamples, const Progress& progress = {});

// Adds how the map told its lines from marks, which are to be on no edge.
void EvaluateMarks(const TrueEdges& truth, const std::vector<MapLine>& marks, int max_samples,
                   LineMetrics* metrics);

// The lines laid over the truth, as the trajectory was.
std::vector<MapLine> Aligned(const Alignment& alignment, std::vector<MapLine> lines);

// Line metrics as a table to read, and as JSON to compute with.

nlohmann::ordered_json LineJson(const ComparedFiles& inputs, const LineMetrics& metrics);

// Clouds and occupancy against true surfaces: metrics, table and JSON.

struct EvaluatedCloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> sources;  // by point: 0 stereo, 1 filled plane
};

// The vertices of a PLY file, with the property `source` where it has one (else 0). Throws
// DataError.
EvaluatedCloud ReadEvaluatedCloud(const std::string& path);

// The cloud laid over the truth, as the trajectory was.
EvaluatedCloud Aligned(const Alignment& alignment, EvaluatedCloud cloud);

// Shares at one tolerance. Accuracy: points with a true surface, seen or not, within it.
// Completeness: samples of the surfaces seen within a range that have a point within it. F is the
// harmonic mean of the two. Each is kNoFigure where it would be of nothing.
struct CloudScore {
  double tolerance_m = 0;
  double accuracy = 0;
  double filled_accuracy = 0;                 // of the points of source 1
  std::array<double, 2> completeness{}, f{};  // of what was seen from up to 4 and 8 m
};

struct CloudMetrics {
  int64_t points = 0, filled = 0;
  double rms_m = 0;        // distance of points to surfaces, those beyond 20 cm left out;
                           // kNoFigure where no point is nearer
  double filled_seen = 0;  // share of the filled points with a sample of what was seen nearby:
                           // others are guessed, however near a surface they are; kNoFigure of none
  std::vector<CloudScore> scores;  // by tolerance
};

// Compares points with surfaces in the same world.
CloudMetrics EvaluateCloud(const TriangleTree& surfaces, const std::vector<SeenSample>& seen,
                           const EvaluatedCloud& cloud);

// How well an occupancy map tells occupied, free and unknown space apart, by true rays.

// Shares of nothing are kNoFigure.
struct OccupancyMetrics {
  int64_t rays = 0;
  double ends_occupied = 0;         // share of rays whose end cell is occupied
  double ends_occupied_nearby = 0;  // or one of the 26 cells around it
  // Of samples along the rays, a cell apart and two cells off their ends: share that is known, and
  // share of the known ones that is free.
  double passages_known = 0, passages_free = 0;
  // Of samples from two cells to half a metre behind the ends that surfaces hide from all views:
  // their number, and the share that is called free.
  int64_t behind = 0;
  double behind_called_free = 0;
};

// Looks at one ray in twenty. `alignment` lays the map's world over that of the views. Throws
// StoppedError when progress says so.
OccupancyMetrics EvaluateOccupancy(const TriangleTree& surfaces,
                                   const std::vector<ReferenceView>& views,
                                   const OccupancyMap& occupancy, const Alignment& alignment,
                                   const Progress& progress = {});

// A cloud and an occupancy map against true surfaces, as tables to read and as JSON.

// What is compared; an empty path: nothing of that kind.
struct SurfaceInputs {
  std::string true_surfaces;  // faces, PLY
  std::string rig;            // true calibration; "": rig.yaml beside the surfaces
  std::string cloud, occupancy;
};

struct SurfaceMetrics {
  std::optional<CloudMetrics> cloud;
  std::optional<OccupancyMetrics> occupancy;
};

// Reads the inputs, finds what the cameras saw from the poses of `truth`, and compares. Throws
// DataError, and StoppedError when progress says so.
SurfaceMetrics EvaluateSurfaces(const SurfaceInputs& inputs, const Trajectory& truth,
                                const Alignment& alignment, const VisibilityOptions& visibility,
                                const Progress& progress = {});

nlohmann::ordered_json SurfaceJson(const SurfaceInputs& inputs, const SurfaceMetrics& metrics);

// Mapped walls, openings, rooms and pipes against true ones: metrics, table and JSON.

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
