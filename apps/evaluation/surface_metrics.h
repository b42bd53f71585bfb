// Clouds and occupancy against true surfaces: metrics, table and JSON.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "data/core/progress.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline evaluation {

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

}  // namespace slcmap::evaluation
