// How straight, flat and square a run is, without a true building.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/edge_straightness.h"
#include "apps/evaluation/reference_observations.h"
#include "data/core/progress.h"

namespace slcmap::inline evaluation {

// A. Kornilova and G. Ferrer, "Be your own benchmark: no-reference trajectory metric on
// registered point clouds", ECMR 2021; the first two go back to D. Droeschel and S. Behnke (2014).
struct FlatnessMetrics {
  int64_t points = 0;            // of the cloud
  int64_t looked_at = 0;         // that have neighbours enough
  double mpv_m2 = 0;             // mean plane variance: mean of the neighbourhoods' least variances
  double mme = 0;                // mean map entropy: of 0.5 ln det(2 pi e covariance), in nats
  int64_t on_planes = 0;         // points on mutually orthogonal planes
  std::optional<double> mom_m2;  // MPV over these; nothing where there are none
};

// radius_m: of a point's neighbourhood. Nothing where no point has neighbours enough. Throws
// StoppedError when progress says so.
std::optional<FlatnessMetrics> MeasureFlatness(const std::vector<Eigen::Vector3d>& points,
                                               double radius_m, const Progress& progress = {});

// Measures of straightness that need no truth, of one trajectory: all trajectories of a sequence
// with the same observations.

// What is known of a sequence beside its recording; nothing where empty.
struct KnownTruth {
  Trajectory trajectory;
  TrueEdges edges;  // in the world of the trajectory
};

// What all trajectories of a sequence are measured with.
struct StraightnessReference {
  ReferenceObservations observations;
  bool true_edges = false;  // tell the edges apart, else the run's lines do
};

// The observations of a run that all `trajectories` have a pose for. Where no true poses are known,
// the run's own, `final_poses`, tell what belongs together. Here and below StoppedError is thrown
// when progress says so.
StraightnessReference MakeReference(const OdometryRun& run, const Trajectory& final_poses,
                                    const std::vector<const Trajectory*>& trajectories,
                                    const KnownTruth& truth, const Progress& progress = {});

struct Straightness {
  EdgeStraightness edges;
  std::optional<DirectionMetrics> directions;  // of the edges' free lines, by their lengths
  std::optional<FlatnessMetrics> flatness;     // of the free points
};

Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Progress& progress = {});

}  // namespace slcmap::evaluation
