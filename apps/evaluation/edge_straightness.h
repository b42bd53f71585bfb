// How straight edges are by observations that are placed alone, and how square directions are.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/reference_observations.h"
#include "data/core/progress.h"

namespace slcmap::inline evaluation {

struct WeightedDirection {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit; its sign means nothing
  double weight = 1;                                     // such as a length
};

struct DirectionMetrics {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, at right angles; of any sign
  double following = 0;                                // share of the weight near an axis
  double dispersion_deg = 0;                           // weighted RMS angle of these to their axes
  // From 90 degrees, of axes that are fitted each by itself; nothing where two have too few.
  std::optional<double> orthogonality_deg;  // the largest
};

// The axes are those, of all pairs of directions, that most weight follows, then refined by least
// squares. The world may be turned as it likes. What is further than max_angle_deg from an axis
// follows none; an axis needs min_weight, a share of all weight, to be fitted by itself. Nothing
// without two directions at about a right angle.
std::optional<DirectionMetrics> MeasureDirections(const std::vector<WeightedDirection>& directions,
                                                  double max_angle_deg = 5,
                                                  double min_weight = 0.02);

// The axis (0, 1, 2) within max_angle_deg of a direction; nothing where there is none.
std::optional<int> FindAxis(const Eigen::Matrix3d& axes, const Eigen::Vector3d& direction,
                            double max_angle_deg);

// How straight edges are that a building has straight: each observation placed alone with the pose
// of its moment, one line fitted to all of them.

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
                                    const Trajectory& trajectory, const Progress& progress = {});

// What is left of a thickness without that which the observations have with true poses: by squares,
// as errors add up that have nothing to do with each other.
double ThicknessBeyond_m(double thickness_m, double with_true_poses_m);

// The observations without those that are far from the line through all of their edge, with the
// poses of one trajectory: of things that its run took for the edge and are not. To be called once,
// for all trajectories.
std::vector<EdgeObservation> OfOneEdge(const std::vector<EdgeObservation>& observations,
                                       const Trajectory& trajectory);

}  // namespace slcmap::evaluation
