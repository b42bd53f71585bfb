// Measures of straightness that need no truth, of one trajectory: all trajectories of a sequence
// with the same observations.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/cloud_flatness.h"
#include "apps/evaluation/direction_metrics.h"
#include "apps/evaluation/edge_straightness.h"
#include "apps/evaluation/map_walls.h"
#include "apps/evaluation/reference_observations.h"
#include "apps/evaluation/wall_finder.h"
#include "apps/evaluation/wall_survey.h"

namespace slcmap {

struct StraightnessOptions {
  PlacementOptions placement;
  EdgeStraightnessOptions edges;
  // A line's direction counts where it is known so well and the line is so long.
  double max_direction_sigma_rad = 0.01, min_line_m = 0.3;
  DirectionOptions directions;
  double max_flat_sigma_m = 0.02;  // of the points whose flatness is measured
  FlatnessOptions flatness;
  double dense_radius_m = 0.1;  // the same of a dense cloud: of a point's neighbourhood
  WallFinderOptions walls;
  MapWallOptions map_walls;
  SurveyOptions survey;
};

// What is known of a sequence beside its recording; nothing where empty.
struct KnownTruth {
  Trajectory trajectory;
  TrueEdges edges;  // in the world of the trajectory
};

// What all trajectories of a sequence are measured with.
struct StraightnessReference {
  ReferenceObservations observations;
  bool true_edges = false;       // tell the edges apart, else the run's lines do
  bool true_poses = false;       // told which observations are of one edge, and the walls
  std::vector<FoundWall> walls;  // of observations.points
};

// The observations of a run that all `trajectories` have a pose for. Where no true poses are known,
// the run's own, `final_poses`, tell what belongs together. Here and below StoppedError is thrown
// when progress says so.
StraightnessReference MakeReference(const OdometryRun& run, const Trajectory& final_poses,
                                    const std::vector<const Trajectory*>& trajectories,
                                    const KnownTruth& truth, const StraightnessOptions& options,
                                    const Progress& progress = {});

struct Straightness {
  EdgeStraightness edges;
  std::optional<DirectionMetrics> directions;  // of the edges' free lines, by their lengths
  std::optional<FlatnessMetrics> flatness;     // of the free points
  Survey survey;
  std::optional<Survey> added;  // what the poses bent; see BendsAdded. With true poses only.
};

// `trajectory` has z against gravity. `truth`: the true trajectory, or an empty one.
Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Trajectory& truth,
                                 const StraightnessOptions& options, const Progress& progress = {});

// The same of a map that was made from images, by its points of stereo depth, which are free.
struct MapStraightness {
  std::optional<FlatnessMetrics> flatness;
  Survey survey;  // of the map's own walls
};
MapStraightness MeasureMapStraightness(const Building& building,
                                       const std::vector<DensePoint>& cloud,
                                       const StraightnessOptions& options,
                                       const Progress& progress = {});

}  // namespace slcmap
