// How straight edges are that a building has straight: each observation placed alone with the pose
// of its moment, one line fitted to all of them.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/evaluation/reference_observations.h"
#include "data/progress.h"

namespace slcmap {

struct EdgeStraightnessOptions {
  int min_observations = 4;     // of an edge
  double pose_sigma_m = 0.001;  // no place counts as if it were known better
  // Bounds of the times between two observations of an edge, ascending; the last is open.
  std::vector<double> times_s = {0, 1, 3, 10, 30};
  // An observation this far from its edge, in standard deviations (of the place, and of 2 cm beside
  // it), is of something else; see OfOneEdge.
  double max_sigmas = 5;
  void Check() const;  // throws ConfigError
};

// A line fitted to observations of an edge, which nothing imposed a direction on.
struct FittedEdge {
  int64_t edge = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();           // in its middle
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();  // unit
  double length_m = 0;
  double direction_sigma_rad = 0;  // where that is largest
  double thickness_m = 0;
  int observations = 0;
};

// How far apart observations of one edge are that were made so long after each other.
struct TimeGap {
  double from_s = 0, to_s = 0;  // to_s is infinite in the last
  int64_t pairs = 0;
  double apart_m = 0;  // RMS; kNoFigure without pairs
};

struct EdgeStraightness {
  int64_t edges = 0;
  int64_t observations = 0;
  int64_t without_pose = 0;  // observations that the trajectory has no pose for
  // RMS distance of the observations' ends from their lines. A distance counts by how well a stereo
  // pair knows it in its direction: with residuals r across the line and weights W = (C + s^2
  // I)^-1, sqrt(2 sum r'Wr / sum tr W). kNoFigure without edges.
  double thickness_m = 0;
  std::vector<TimeGap> gaps;
  std::vector<FittedEdge> lines;  // by edge
};

// Throws StoppedError when progress says so.
EdgeStraightness RetriangulateEdges(const std::vector<EdgeObservation>& observations,
                                    const Trajectory& trajectory,
                                    const EdgeStraightnessOptions& options,
                                    const Progress& progress = {});

// The observations without those that are far from the line through all of their edge, with the
// poses of one trajectory: of things that its run took for the edge and are not. To be called once,
// for all trajectories.
std::vector<EdgeObservation> OfOneEdge(const std::vector<EdgeObservation>& observations,
                                       const Trajectory& trajectory,
                                       const EdgeStraightnessOptions& options);

}  // namespace slcmap
