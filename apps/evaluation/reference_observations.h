// What all trajectories of a sequence are measured with: the stereo observations of one run, each
// placed in space by itself, so that nothing that a method imposes on its map is in them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "apps/evaluation/truth.h"
#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "odometry/run/run.h"

namespace slcmap::inline evaluation {

// A place in the frame of the IMU, from one stereo pair alone.
struct Placed {
  Eigen::Vector3d p_imu = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  // of rank 2 or 3, in the IMU's axes
};

// What one stereo pair shows of an edge. Ends along it are not repeatable.
struct EdgeObservation {
  int64_t edge = 0;
  int64_t stamp_ns = 0;
  std::array<Placed, 2> ends;
};

struct PointOfPair {
  int64_t stamp_ns = 0;
  Placed place;
};

struct ReferenceObservations {
  std::vector<EdgeObservation> edges;  // by keyframe
  std::vector<PointOfPair> points;     // by keyframe
  int64_t left_out = 0;  // observations whose places are not known, or not well enough
};

// The observations of a run's lines and points by both cameras. Edges are those that the run took
// its lines to be. Throws StoppedError when progress says so.
ReferenceObservations ObservationsOfRun(const OdometryRun& run, const Progress& progress = {});

// The same observations of edges, told apart by the true edges that they lie on from true poses, so
// that an edge that is seen again later is one edge, whatever the run took it for. What is on none,
// or on several, is left out; so is what has no true pose.
std::vector<EdgeObservation> OnTrueEdges(const std::vector<EdgeObservation>& observations,
                                         const Trajectory& truth, const TrueEdges& edges);

// Those that all trajectories have a pose for.
ReferenceObservations SeenByAll(const ReferenceObservations& observations,
                                const std::vector<const Trajectory*>& trajectories);

// A place as a pose has it in the world.
struct PlacedInWorld {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
};
PlacedInWorld InWorld(const Placed& place, const RigidTransform& T_world_imu);

}  // namespace slcmap::evaluation
